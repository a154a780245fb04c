// The connection to the page's server: it comes back by itself, with the new token of a new server.

const RETRY_MS = 1000;

export class Link {
  #socket = null;
  #token = document.querySelector('meta[name=token]').content;
  #onMessage;
  #onState;

  // onMessage(object); onState(connected, why) at every change.
  constructor(onMessage, onState) {
    this.#onMessage = onMessage;
    this.#onState = onState;
    this.#open();
  }

  #open() {
    const scheme = location.protocol === 'https:' ? 'wss' : 'ws';
    const socket = new WebSocket(`${scheme}://${location.host}/ws`, ['w2b', this.#token]);
    this.#socket = socket;
    socket.onopen = () => this.#onState(true, '');
    socket.onmessage = event => {
      const message = JSON.parse(event.data);
      // Answered here, not by a timer, which browsers slow down in the background.
      if (message.k === 'ping') this.send({ do: 'pong', number: 0 });
      else this.#onMessage(message);
    };
    socket.onclose = event => {
      this.#onState(false, event.reason);
      setTimeout(() => this.#again(), RETRY_MS);
    };
  }

  async #again() {
    try {
      const response = await fetch('/', { cache: 'no-store' });
      if (response.redirected) { location.reload(); return; }
      const found = /name="token" content="([^"]*)"/.exec(await response.text());
      if (found) this.#token = found[1];
    } catch {
      this.#onState(false, '');
      setTimeout(() => this.#again(), RETRY_MS);
      return;
    }
    this.#open();
  }

  // Returns whether it went out.
  send(request) {
    if (this.#socket?.readyState !== WebSocket.OPEN) return false;
    this.#socket.send(JSON.stringify(request));
    return true;
  }

  // A piece of sound, between the requests talk and talked.
  sendSound(buffer) { if (this.#socket?.readyState === WebSocket.OPEN) this.#socket.send(buffer); }
}
