// What was understood, and what was said when.

import { colourOf } from './colours.js';
import { byId, element, write } from './dom.js';

// Level of an answer to a word that changes nothing.
export const REFUSED = 2;
const FOLLOWS = { true: 'the body follows it', pending: 'waiting for the body …', false: 'no body follows' };

// "... did you mean 'forward' or 'forwards'?" -> ['forward', 'forwards']
function meant(message) {
  const tail = message.split('did you mean ')[1];
  return tail ? [...tail.matchAll(/'([^']+)'/g)].map(found => found[1]) : [];
}

export function showAnswer(answer, say) {
  const card = byId('answer'), refused = answer.level >= REFUSED;
  const greeting = answer.received === 0;
  card.className = greeting ? '' : refused ? 'bad' : answer.level ? 'warn' : 'good';
  const heard = greeting ? '' : `“${answer.text}”: `;
  // Where the brain names a behaviour its message says no more than what is shown below.
  const brief = answer.behaviour && answer.message.startsWith('following');
  const headline = refused ? `refused: ${answer.message}` : brief ? `following ${answer.behaviour}` : answer.message;
  write(byId('answer-message'), greeting ? 'The brain listens: no command yet.' : heard + headline);
  const probability = Number(answer.probability);
  const sure = !refused && answer.probability !== undefined && Number.isFinite(probability);
  byId('sure').hidden = !sure;
  if (sure) {
    byId('meter').value = probability;
    write(byId('sure-text'), `probability ${probability.toFixed(2)}`
      + (answer.trained === 'no' ? ' · never heard in training' : ''));
  }
  write(byId('nearest'), answer.nearest ? `nearest: ${answer.nearest}` : '');
  const others = refused ? meant(answer.message) : [];
  if (others.length) {
    byId('nearest').replaceChildren('say instead: ', ...others.map(word => {
      const button = element('button', word, { type: 'button', class: 'chip' });
      button.addEventListener('click', () => say(word));
      return button;
    }));
  }
  const follows = greeting || refused ? '' : FOLLOWS[answer.body_follows] ?? '';
  write(byId('follows'), follows && answer.body_follows !== 'true' && answer.why_not
    ? `${follows}: ${answer.why_not}` : follows);
  byId('follows').className = answer.body_follows === 'true' ? 'ok' : 'dim';
}

export function showSaid(entries, put) {
  byId('said').replaceChildren(...entries.slice().reverse().map(entry => {
    const item = element('li', '', { class: entry.level >= REFUSED ? 'refused' : '' });
    const at = new Date(entry.at * 1000), dot = element('i');
    dot.style.background = entry.level >= REFUSED ? 'transparent' : colourOf(entry.behaviour);
    const word = element('button', entry.text, { type: 'button', title: `${entry.message} (put it into the box)` });
    word.addEventListener('click', () => put(entry.text));
    item.append(element('time', at.toLocaleTimeString([], { hour12: false }), { datetime: at.toISOString() }),
      dot, word, element('small', entry.level >= REFUSED ? 'refused' : entry.behaviour || 'understood'));
    return item;
  }));
}

export function showLegend(behaviours) {
  byId('legend').replaceChildren(...behaviours.map(behaviour => {
    const item = element('li', behaviour || 'no word'), dot = element('i');
    dot.style.background = colourOf(behaviour);
    item.prepend(dot);
    return item;
  }));
}
