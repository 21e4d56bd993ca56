// Colour scales of maps: batlow and vik of F. Crameri, equal steps of which look equal, to
// colour-blind readers too.

const SCALES = {
  batlow: ["#011959", "#103f60", "#1c5460", "#3c6d56", "#687b3e", "#9d892b", "#d29343", "#f8a17b", "#fdb7bc", "#faccfa"],
  vik: ["#001261", "#033e7d", "#1e6f9d", "#71a8c4", "#c9dde7", "#eacebd", "#d39774", "#be6533", "#8b2706", "#590008"],
};

function channels(hex) {
  return [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16));
}

/** Red, green and blue of a scale at a share from 0 to 1. */
function colourAt(scale, share) {
  const stops = SCALES[scale];
  const at = Math.max(0, Math.min(1, share)) * (stops.length - 1);
  const i = Math.min(stops.length - 2, Math.floor(at));
  const [a, b] = [channels(stops[i]), channels(stops[i + 1])];
  return a.map((v, k) => Math.round(v + (at - i) * (b[k] - v)));
}

/** A grid of values as a picture: its address, row 0 at the bottom; null leaves a hole. */
export function picture(values, scale, [low, high]) {
  const canvas = document.createElement("canvas");
  canvas.height = values.length;
  canvas.width = values[0].length;
  const context = canvas.getContext("2d");
  const image = context.createImageData(canvas.width, canvas.height);
  values.forEach((row, j) => row.forEach((value, i) => {
    if (value === null) return;
    const at = 4 * ((values.length - 1 - j) * canvas.width + i);
    image.data.set([...colourAt(scale, (value - low) / (high - low)), 255], at);
  }));
  context.putImageData(image, 0, 0);
  return canvas.toDataURL();
}

/** Stops of a gradient with the colours of a scale. */
export function stops(scale) {
  return SCALES[scale].map((colour, i) => ({ offset: i / (SCALES[scale].length - 1), colour }));
}
