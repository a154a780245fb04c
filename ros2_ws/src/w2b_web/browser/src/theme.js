// Light, dark, or as the system has it.

import { byId, write } from './dom.js';

const NAMES = ['auto', 'light', 'dark'];
const system = matchMedia('(prefers-color-scheme: dark)');

// changed(name): called with light or dark, at once and at every change.
export function followTheme(changed) {
  let chosen = NAMES.includes(localStorage.getItem('theme')) ? localStorage.getItem('theme') : 'auto';
  const apply = () => {
    const name = chosen === 'auto' ? (system.matches ? 'dark' : 'light') : chosen;
    document.documentElement.dataset.theme = name;
    write(byId('theme'), { auto: 'Auto', light: 'Light', dark: 'Dark' }[chosen]);
    byId('theme').setAttribute('aria-label', `Colours: ${chosen}`);
    changed(name);
  };
  byId('theme').addEventListener('click', () => {
    chosen = NAMES[(NAMES.indexOf(chosen) + 1) % NAMES.length];
    localStorage.setItem('theme', chosen);
    apply();
  });
  system.addEventListener('change', apply);
  apply();
}
