// What is measured, over the last seconds.

import uPlot from 'uplot';
import { seriesColour } from './colours.js';
import { element } from './dom.js';

const SHOWN_S = 20;
const HEIGHT_PX = 120;

export class Plot {
  #names = [];
  #data = [[]];
  #plot = null;
  #place;
  #legend;

  constructor(place, legend, names) {
    this.#place = place;
    this.#legend = legend;
    if (names) this.name(names);
    new ResizeObserver(() => this.#plot?.setSize({
      width: this.#width(), height: HEIGHT_PX })).observe(place);
  }

  #width() { return Math.max(50, this.#place.clientWidth); }

  // In the colours of the theme; what was drawn goes.
  restyle() { if (this.#plot) this.name(this.#names); }

  name(names) {
    this.#plot?.destroy();
    this.#names = names;
    this.#data = [[], ...names.map(() => [])];
    const style = getComputedStyle(document.documentElement);
    const ink = style.getPropertyValue('--dim'), rule = style.getPropertyValue('--line');
    const axis = { stroke: ink, grid: { stroke: rule, width: 1 }, ticks: { show: false },
      font: '11px system-ui' };
    this.#plot = new uPlot({
      width: this.#width(), height: HEIGHT_PX, scales: { x: { time: false } },
      legend: { show: false }, cursor: { show: false },
      axes: [{ ...axis, size: 22 }, { ...axis, size: 42 }],
      series: [{}, ...names.map((label, index) => ({
        label, stroke: seriesColour(index, names.length), width: 1.4, points: { show: false } }))],
    }, this.#data, this.#place);
    this.#legend?.replaceChildren(...names.map((name, index) => {
      const item = element('li', name), dot = element('i');
      dot.style.background = seriesColour(index, names.length);
      item.prepend(dot);
      return item;
    }));
  }

  add(time, values) {
    const times = this.#data[0];
    // Time went back: the simulation was reset.
    if (times.length && time < times.at(-1)) for (const column of this.#data) column.length = 0;
    times.push(time);
    values.forEach((value, index) => this.#data[index + 1]?.push(value));
    let old = 0;
    while (times[old] < time - SHOWN_S) old++;
    if (old > 50) for (const column of this.#data) column.splice(0, old);
  }

  draw() {
    if (!this.#plot || !this.#place.clientWidth) return;
    const last = this.#data[0].at(-1) ?? 0;
    this.#plot.setData(this.#data, false);
    this.#plot.setScale('x', { min: Math.max(this.#data[0][0] ?? 0, last - SHOWN_S), max: last });
  }
}
