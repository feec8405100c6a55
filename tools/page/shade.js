// Views of an image as display bytes.

const views = {
  radiance: 'image', signed: 'error (red: too bright)', relative: 'relative error', stddev: 'predicted error (error map)',
};

/** Display bytes of a view of an image. gain multiplies radiance and absolute errors. */
function shade(view, image, reference, gain, out) {
  const { width, height, radiance, stddev } = image, n = width * height;
  for (let i = 0; i < n; ++i) {
    let rgb;
    if (view === 'radiance') {
      rgb = [0, 1, 2].map((c) => { const v = radiance[c * n + i]; return Number.isFinite(v) ? srgb(v * gain) : c === 1 ? 255 : 0; });
    } else if (view === 'stddev') {
      rgb = stddev ? heat(Math.sqrt(stddev[i] * gain)) : [90, 90, 90];
    } else {
      let signed = 0, relative = 0;
      for (let c = 0; c < 3; ++c) {
        const r = reference.radiance[c * n + i], e = radiance[c * n + i] - r;
        signed += e / 3;
        relative += Math.abs(e) / (Math.abs(r) + .01) / 3;
      }
      // From 0.1 % to 100 %, as vlx-compare's pictures.
      rgb = view === 'signed' ? diverging(signed * gain * 4) : heat(1 + Math.log10(Math.max(relative, 1e-9)) / 3);
    }
    out[4 * i] = rgb[0]; out[4 * i + 1] = rgb[1]; out[4 * i + 2] = rgb[2]; out[4 * i + 3] = 255;
  }
}

async function canvasOf(view, image, reference, gain) {
  const pixels = await decoded(image);
  const canvas = make('canvas', { width: pixels.width, height: pixels.height });
  const data = new ImageData(pixels.width, pixels.height);
  shade(view, pixels, reference ? await decoded(reference) : null, gain, data.data);
  canvas.getContext('2d').putImageData(data, 0, 0);
  return canvas;
}
