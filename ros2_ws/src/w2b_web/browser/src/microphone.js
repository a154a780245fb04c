// Runs in the browser's audio thread: its sound in pieces of 16 kHz, one channel, 16 bits.

const RATE_HZ = 16000, PIECE = 1024;

class Microphone extends AudioWorkletProcessor {
  #piece = new Int16Array(PIECE);
  #filled = 0;
  #sum = 0;
  #count = 0;
  #due = 0;

  process([[channel]]) {
    for (const sample of channel ?? []) {
      // At another rate: the mean of what came since the last one.
      this.#sum += sample;
      this.#count += 1;
      this.#due += RATE_HZ / sampleRate;
      if (this.#due < 1) continue;
      this.#due -= 1;
      this.#piece[this.#filled++] = Math.max(-1, Math.min(1, this.#sum / this.#count)) * 32767;
      this.#sum = this.#count = 0;
      if (this.#filled === PIECE) {
        this.port.postMessage(this.#piece.buffer.slice(0));
        this.#filled = 0;
      }
    }
    return true;
  }
}

registerProcessor('microphone', Microphone);
