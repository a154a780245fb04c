// The box for words: suggestions while typing (a combobox, ARIA 1.2), earlier words by arrow keys.

import { colourOf } from './colours.js';
import { byId, element } from './dom.js';

const KEPT = 50;

export class Words {
  #box = byId('word');
  #list = byId('suggestions');
  #earlier = [];
  #place = 0;
  #chosen = -1;
  #asked = '';
  #offered = '';
  #ask;
  #say;

  // ask(text): have the words that complete it looked up; say(text): say it.
  constructor({ ask, say }) {
    this.#ask = ask;
    this.#say = say;
    byId('form').addEventListener('submit', event => { event.preventDefault(); this.#submit(); });
    this.#box.addEventListener('input', () => {
      this.#asked = this.#box.value;
      if (this.#asked.trim()) this.#ask(this.#asked); else this.#close();
    });
    this.#box.addEventListener('keydown', event => this.#onKey(event));
    this.#box.addEventListener('blur', () => this.#close());
  }

  focus() { this.#box.focus(); this.#box.select(); }

  put(text) { this.#box.value = text; this.focus(); }

  // Puts what was heard into the box, unless a person is typing there; returns whether it did.
  offer(text) {
    if (![this.#offered, ''].includes(this.#box.value)) return false;
    this.#offered = text;
    this.put(text);
    return true;
  }

  // What the server found for a text; without a text, the words to begin with.
  found({ prefix, words }) {
    if (prefix === '') { this.#starters(words); return; }
    if (prefix !== this.#asked || document.activeElement !== this.#box) return;
    const own = prefix.split(' ').at(-1).toLowerCase();
    const others = words.filter(({ word }) => word !== own);
    this.#chosen = -1;
    this.#list.replaceChildren(...others.map(({ word, behaviour }, index) => {
      const option = element('li', word, { role: 'option', id: `option-${index}`, 'aria-selected': 'false' });
      if (behaviour) option.append(element('small', behaviour === word ? 'trained' : `→ ${behaviour}`));
      option.addEventListener('pointerdown', event => { event.preventDefault(); this.#complete(word); });
      return option;
    }));
    const open = others.length > 0;
    this.#list.hidden = !open;
    this.#box.setAttribute('aria-expanded', String(open));
  }

  #starters(words) {
    byId('starters').replaceChildren(...words.map(({ word, behaviour }) => {
      const button = element('button', word, { type: 'button', title: `asks for ${behaviour}` });
      const dot = element('i');
      dot.style.background = colourOf(behaviour);
      button.prepend(dot);
      button.addEventListener('click', () => this.#say(word));
      return button;
    }));
  }

  #complete(word) {
    const words = this.#box.value.split(' ');
    words[words.length - 1] = word;
    this.#box.value = words.join(' ');
    this.#close();
    this.#box.focus();
  }

  #close() {
    this.#asked = '';
    this.#list.hidden = true;
    this.#chosen = -1;
    this.#box.setAttribute('aria-expanded', 'false');
    this.#box.removeAttribute('aria-activedescendant');
  }

  #choose(index) {
    const options = [...this.#list.children];
    this.#chosen = (index + options.length) % options.length;
    options.forEach((option, at) => option.setAttribute('aria-selected', String(at === this.#chosen)));
    this.#box.setAttribute('aria-activedescendant', `option-${this.#chosen}`);
    options[this.#chosen].scrollIntoView({ block: 'nearest' });
  }

  #onKey(event) {
    const open = !this.#list.hidden && this.#list.children.length > 0;
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (event.key === 'Tab' && open && this.#chosen >= 0) {
      event.preventDefault();
      this.#complete(this.#list.children[this.#chosen].firstChild.textContent);
    } else if (step && open) {
      event.preventDefault();
      this.#choose(this.#chosen < 0 && step < 0 ? -1 : this.#chosen + step);
    } else if (step && this.#earlier.length) {
      event.preventDefault();
      this.#place = Math.min(Math.max(this.#place + step, 0), this.#earlier.length);
      this.#box.value = this.#earlier[this.#place] ?? '';
    }
  }

  #submit() {
    if (!this.#list.hidden && this.#chosen >= 0) {
      this.#complete(this.#list.children[this.#chosen].firstChild.textContent);
    }
    const text = this.#box.value.trim();
    this.#close();
    if (!text) return;
    if (!this.#say(text)) return;
    if (this.#earlier.at(-1) !== text) this.#earlier.push(text);
    if (this.#earlier.length > KEPT) this.#earlier.shift();
    this.#place = this.#earlier.length;
    this.#box.value = '';
  }
}
