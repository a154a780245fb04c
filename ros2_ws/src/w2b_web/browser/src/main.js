// The page of w2b: see the robot, say words to it, stop it.

import { REFUSED, showAnswer, showLegend, showSaid } from './answers.js';
import { colourOf } from './colours.js';
import { byId, element, write } from './dom.js';
import { Link } from './link.js';
import { pill, showLights, showNote, showState, trouble } from './panels.js';
import { Plot } from './plots.js';
import { View } from './scene.js';
import { Talk } from './talk.js';
import { followTheme } from './theme.js';
import { Words } from './words.js';

const PLOT_MS = 250, DESCRIBE_MS = 1000;
const DEGREES = 180 / Math.PI;
const shown = { connected: false, why: '', state: null };
let view = null, names = { joints: [], contacts: [] }, behaviour = '', last = null, robot = '';
let used = [''];
const plots = {
  joints: new Plot(byId('joints'), byId('joints-legend')),
  turning: new Plot(byId('turning'), byId('turning-legend'), ['roll', 'pitch', 'yaw']),
  supply: new Plot(byId('supply'), null, ['supply']),
};
try {
  view = new View(byId('view'));
} catch {
  byId('view').append(element('p', 'This browser has no WebGL: the robot is not drawn. Words, STOP '
    + 'and plots work.', { class: 'missing' }));
}

const link = new Link(take, (connected, why) => {
  shown.connected = connected;
  shown.why = why;
  pill('page', connected ? 'ok' : 'bad', connected ? 'connected' : 'no connection');
  document.body.classList.toggle('offline', !connected);
  if (connected) { send({ do: 'suggest', text: '' }); if (robot) link.send({ do: 'watch', robot }); }
  warn();
});

function send(request) {
  if (link.send(request)) return true;
  showNote('bad', 'not sent: no connection');
  return false;
}

const say = text => send({ do: 'say', text, robot });
const words = new Words({ ask: text => link.send({ do: 'suggest', text }), say });
const talk = new Talk(byId('talk'), {
  send: request => send({ ...request, robot }), sound: buffer => link.sendSound(buffer), note: showNote });

function heard({ text, sent }) {
  if (!text) showNote('warn', 'heard none of the words that can be spoken: hold Talk while you say one word, or type it');
  else if (sent) showNote('ok', `heard “${text}”: said`);
  else if (words.offer(text)) showNote('ok', `heard “${text}”: Enter says it`);
  else showNote('ok', `heard “${text}”: not put into the box, where you type`);
}

function stop() {
  if (send({ do: 'stop', robot })) showNote('warn', 'STOP sent …');
}

function warn() {
  const text = trouble(shown), banner = byId('banner');
  banner.hidden = !text;
  write(banner, text);
}

const takers = {
  f: frame,
  names: message => { names = message; plots.joints.name(message.joints.map(name => name.replace(/_joint$/, ''))); showContacts([]); },
  shape: shape => {
    view?.build(shape);
    for (const note of shape.notes) showNote('warn', note);
  },
  state: state => {
    // A brain that came: what it knows may be new.
    if (state.brain && !shown.state?.brain) setTimeout(() => link.send({ do: 'suggest', text: '' }), 800);
    // Put back to its start, or started again: the path was another life's.
    if (!state.hardware && shown.state?.epoch && state.epoch && state.epoch !== shown.state.epoch) view?.clearPath();
    shown.state = state;
    showState(state);
    showNow();
    warn();
  },
  answer: answer => { follow(answer); showAnswer(answer, say); },
  said: ({ entries }) => showSaid(entries, text => words.put(text)),
  lights: ({ items }) => showLights(items),
  supply: ({ volts }) => {
    byId('supply-part').hidden = false;
    plots.supply.add(performance.now() / 1000, [volts]);
  },
  note: ({ level, text }) => showNote(level, text),
  words: found => words.found(found),
  robots: ({ names: found }) => {
    byId('robots').replaceChildren(...found.map(name => element('option', name || '/', { value: name })));
    byId('robots').value = robot;
    byId('robots-label').hidden = byId('stop-all').hidden = found.length < 2;
  },
  watching: message => {
    if (message.robot !== robot) forget();
    robot = message.robot;
    byId('robots').value = robot;
  },
  hello: message => talk.offer(message.talk),
  heard,
};

function take(message) { takers[message.k]?.(message); }

function forget() {
  behaviour = '';
  last = null;
  shown.state = null;
  view?.clearPath();
}

// A refused word changes nothing: the robot goes on with what it does.
function follow(answer) {
  if (answer.level >= REFUSED) return;
  const standing = answer.received === 0 || answer.message.startsWith('standing');
  behaviour = standing ? '' : answer.behaviour ?? answer.text;
  if (!used.includes(behaviour)) used = [...used, behaviour];
  showLegend(used);
  showNow();
}

function showNow() {
  const { state } = shown, moving = state?.follows && state?.brain;
  write(byId('now-word'), behaviour || 'no word yet');
  byId('now').style.setProperty('--colour', colourOf(behaviour));
  write(byId('now-what'), !state ? '' : state.state === 'PAUSED' ? 'paused' : moving ? '' :
    state.state === 'none' ? 'no body' : state.state.toLowerCase());
}

function frame(message) {
  if (last && message.t < last.t) view?.clearPath();
  last = message;
  view?.frame(message, names.joints, names.contacts, colourOf(behaviour));
  plots.joints.add(message.t, message.q.map(angle => (angle === null ? null : angle * DEGREES)));
  if (message.w) plots.turning.add(message.t, message.w.map(rate => rate * DEGREES));
  showContacts(message.c);
}

function showContacts(touching) {
  const list = byId('contacts');
  if (list.children.length !== touching.length)
    list.replaceChildren(...names.contacts.slice(0, touching.length).map(name => element('li', name.replace(/_(foot|link|shank|lower)$/, ''))));
  touching.forEach((touch, index) => {
    const item = list.children[index];
    if (item.classList.contains('on') !== Boolean(touch)) item.classList.toggle('on', Boolean(touch));
  });
}

function heading([w, x, y, z]) { return Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)) * DEGREES; }

function describe() {
  if (!last) return;
  const turned = last.o ? heading(last.o) : null, rows = [];
  if (last.p) rows.push(['x', `${last.p[0].toFixed(2)} m`], ['y', `${last.p[1].toFixed(2)} m`]);
  else rows.push(['place', 'no odometry']);
  if (turned !== null) rows.push(['heading', `${turned.toFixed(0)}°`]);
  rows.push(['time', `${last.t.toFixed(1)} s`]);
  const pose = byId('pose');
  if (pose.children.length !== rows.length)
    pose.replaceChildren(...rows.map(() => { const row = element('div'); row.append(element('dt'), element('dd')); return row; }));
  rows.forEach(([name, value], index) => {
    write(pose.children[index].firstChild, name);
    write(pose.children[index].lastChild, value);
  });
}

setInterval(() => {
  if (document.hidden) return;
  describe();
  if (byId('plots').open) for (const plot of Object.values(plots)) plot.draw();
}, PLOT_MS);
setInterval(() => {
  if (!last) return;
  const where = last.p ? `at x ${last.p[0].toFixed(1)}, y ${last.p[1].toFixed(1)} metres` : 'place unknown';
  byId('view').setAttribute('aria-label', `The robot ${where}, following ${behaviour || 'no word'}; arrow keys turn the view, + and - zoom`);
}, DESCRIBE_MS);

byId('stop').addEventListener('click', stop);
byId('stop-all').addEventListener('click', () => send({ do: 'stop_all' }));
addEventListener('keydown', event => {
  if (event.key === 'Escape') stop();
  else if (event.key === '/' && !/^(INPUT|SELECT|TEXTAREA)$/.test(document.activeElement.tagName)) {
    event.preventDefault();
    words.focus();
  }
}, { capture: true });
for (const button of document.querySelectorAll('[data-do]'))
  button.addEventListener('click', () => send({ do: button.dataset.do, robot }));
for (const button of document.querySelectorAll('[data-view]'))
  button.addEventListener('click', () => (button.dataset.view === 'clear' ? view?.clearPath() : view?.view(button.dataset.view)));
byId('pause').addEventListener('click', () => send({ do: shown.state?.state === 'PAUSED' ? 'resume' : 'pause', robot }));
byId('speed').addEventListener('change', event => send({ do: 'speed', number: Number(event.target.value), robot }));
byId('robots').addEventListener('change', event => send({ do: 'watch', robot: event.target.value }));
byId('arm').addEventListener('click', () => byId('arm-dialog').showModal());
byId('arm-dialog').addEventListener('close', event => {
  if (event.target.returnValue === 'yes') send({ do: 'arm', confirmed: true, robot });
  event.target.returnValue = '';
});
followTheme(name => {
  view?.theme(name);
  for (const plot of Object.values(plots)) plot.restyle();
});
// For the tests: what was drawn.
window.w2b = { shown, get drawn() { return view?.drawn ?? 0; }, get last() { return last; }, get behaviour() { return behaviour; } };
