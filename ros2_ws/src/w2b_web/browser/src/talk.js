// Push to talk: while the button is held, what the microphone hears goes to the server.

import { write } from './dom.js';

// A word ends a little later than people let go; the server takes 6 s at most.
const AFTER_MS = 250, LONGEST_MS = 5800, RATE_HZ = 16000;

export class Talk {
  #button;
  #send;
  #sound;
  #note;
  #held = false;
  #open = null;
  #timer = 0;

  // send(request), sound(buffer): to the server; note(level, text): to the person.
  constructor(button, { send, sound, note }) {
    this.#button = button;
    this.#send = send;
    this.#sound = sound;
    this.#note = note;
    button.addEventListener('pointerdown', event => {
      if (event.button !== 0) return;
      button.setPointerCapture(event.pointerId);
      this.#press();
    });
    for (const kind of ['pointerup', 'pointercancel', 'lostpointercapture', 'blur'])
      button.addEventListener(kind, () => this.#release());
    button.addEventListener('contextmenu', event => event.preventDefault());
    button.addEventListener('keydown', event => {
      if (event.key !== ' ') return;
      event.preventDefault();
      if (!event.repeat) this.#press();
    });
    button.addEventListener('keyup', event => { if (event.key === ' ') this.#release(); });
    addEventListener('blur', () => this.#release());
  }

  // Whether the server recognises speech; without, or without a microphone, there is no button.
  offer(there) { this.#button.hidden = !there || !navigator.mediaDevices?.getUserMedia; }

  async #press() {
    if (this.#held || this.#open) return;
    this.#held = true;
    this.#show('…');
    try {
      const stream = await navigator.mediaDevices.getUserMedia({ audio: { channelCount: 1 } });
      this.#open = await this.#listen(stream);
    } catch (error) {
      this.#held = false;
      this.#show('Talk');
      this.#note('bad', `no microphone: ${error.message}`);
      return;
    }
    if (!this.#held) {
      this.#close();
      this.#note('warn', 'the microphone is ready: hold Talk and say one word');
    } else if (this.#send({ do: 'talk' })) {
      this.#show('Speak');
      this.#timer = setTimeout(() => this.#release(), LONGEST_MS);
    } else {
      this.#held = false;
      this.#close();
    }
  }

  async #listen(stream) {
    const made = rate => {
      const context = new AudioContext(rate);
      try {
        return [context, context.createMediaStreamSource(stream)];
      } catch (error) {
        context.close();
        throw error;
      }
    };
    let context, source;
    try {
      [context, source] = made({ sampleRate: RATE_HZ });
    } catch {
      // Firefox takes a microphone at its own rate only.
      [context, source] = made({});
    }
    await context.audioWorklet.addModule('/microphone.js');
    const node = new AudioWorkletNode(context, 'microphone', { numberOfOutputs: 0 });
    node.port.onmessage = event => { if (this.#talking) this.#sound(event.data); };
    source.connect(node);
    return { context, stream };
  }

  get #talking() { return this.#timer !== 0; }

  #release() {
    if (!this.#held) return;
    this.#held = false;
    if (!this.#talking) return;
    clearTimeout(this.#timer);
    this.#show('…');
    this.#timer = setTimeout(() => {
      this.#close();
      this.#send({ do: 'talked' });
    }, AFTER_MS);
  }

  #close() {
    clearTimeout(this.#timer);
    this.#timer = 0;
    for (const track of this.#open?.stream.getTracks() ?? []) track.stop();
    this.#open?.context.close();
    this.#open = null;
    this.#show('Talk');
  }

  #show(text) {
    write(this.#button, text);
    this.#button.setAttribute('aria-pressed', String(this.#held));
    this.#button.classList.toggle('live', text === 'Speak');
  }
}
