// One colour a behaviour, on the path, in the strip and in the legend.

const BEHAVIOURS = {
  forward: '#2f81f7', backward: '#e8890c', left: '#12a97b', right: '#9a5cf5', sit: '#8b98a9',
  stop: '#e5484d', '': '#8b98a9',
};

export function colourOf(behaviour) {
  if (behaviour in BEHAVIOURS) return BEHAVIOURS[behaviour];
  let hash = 0;
  for (const letter of behaviour) hash = (hash * 31 + letter.codePointAt(0)) % 360;
  return `hsl(${hash} 65% 52%)`;
}

// Twelve series: legs by hue, the joints of a leg by lightness.
export function seriesColour(index, count) {
  const hue = (index * 360) / Math.max(3, count);
  return `hsl(${Math.round(hue + 210) % 360} 70% ${index % 2 ? 58 : 46}%)`;
}
