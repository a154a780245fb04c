// How body, brain, connection and parts are, as lights with text.

import { byId, element, write } from './dom.js';

const LEVELS = ['ok', 'warn', 'bad', 'stale'];
const WORDS = ['OK', 'warning', 'error', 'silent'];

export function pill(name, level, text) {
  const item = byId(`pill-${name}`);
  item.className = level;
  item.title = text;
  write(item.querySelector('em'), `: ${text}`);
}

export function showLights(items) {
  const worst = Math.max(0, ...items.map(item => item.level));
  byId('worst').className = LEVELS[worst];
  write(byId('worst'), items.length ? WORDS[worst] : 'nobody reports');
  const list = byId('lights');
  const old = new Map([...list.children].map(item => [item.dataset.name, item]));
  list.replaceChildren(...items.map(({ name, level, text }) => {
    const item = old.get(name) ?? element('li', '', { 'data-name': name });
    if (!item.firstChild) item.append(element('i'), element('b', name), element('em'), element('span'));
    item.className = LEVELS[level];
    write(item.children[2], WORDS[level]);
    write(item.children[3], text);
    return item;
  }));
}

// What a person has to know before anything else; empty if all is well.
export function trouble({ connected, why, state }) {
  if (!connected) {
    return why ? `The server ended the connection: ${why}. Trying again …` :
      'No connection to the page’s server. What you see is old, and STOP does not get through: '
      + 'run “w2b stop”, or cut the power. Trying again …';
  }
  if (!state) return '';
  if (state.state === 'none') {
    return state.brain ? 'No body: start a simulation (w2b sim) or the robot (w2b hardware).' :
      'Nobody is there yet: no body, no brain. “w2b play” starts both.';
  }
  if (!state.brain)
    return 'The brain is gone: no word is heard. The body holds; STOP still works. Start it: w2b brain';
  if (!state.frames) return `${state.body} sends no sensor frames.`;
  return '';
}

export function showState(state) {
  const gone = state.state === 'none';
  pill('brain', state.brain ? 'ok' : 'bad', state.brain ? 'listens' : 'none');
  pill('body', gone ? 'bad' : state.follows ? 'ok' : 'warn',
    gone ? 'none' : state.state.toLowerCase());
  write(byId('body-name'), state.body);
  write(byId('body-state'), gone ? '' : `${state.state.toLowerCase()}: ${state.reason}`);
  document.body.dataset.kind = state.hardware === null ? 'none' : state.hardware ? 'hardware' : 'simulation';
  const paused = state.state === 'PAUSED', pause = byId('pause');
  write(pause, paused ? 'Resume' : 'Pause');
  pause.setAttribute('aria-pressed', String(paused));
  pause.classList.toggle('primary', paused);
}

let fading = 0;

export function showNote(level, text) {
  const note = byId('note');
  note.className = level;
  write(note, text);
  clearTimeout(fading);
  if (level === 'ok') fading = setTimeout(() => write(note, ''), 6000);
}
