// Frames: where pictures are drawn before they are shown, so that a picture may take its time while the last one stays.

export const COARSE_SHARE = 0.6; // of the canvas' width and height, drawn while all moves slowly

/** {still: smooth edges, moving: quick}; each {begin(width, height), show()}. */
export const framesOf = (gl) => ({ still: frameOf(gl, 4), moving: frameOf(gl, 0) });

export function frameOf(gl, samples) {
  const frame = gl.createFramebuffer(), colour = gl.createRenderbuffer(), depth = gl.createRenderbuffer();
  let width = 0, height = 0;
  const begin = (w, h) => {
    if (w !== width || h !== height) {
      [width, height] = [w, h];
      for (const [store, format] of [[colour, gl.RGBA8], [depth, gl.DEPTH_COMPONENT24]]) {
        gl.bindRenderbuffer(gl.RENDERBUFFER, store);
        gl.renderbufferStorageMultisample(gl.RENDERBUFFER, samples, format, width, height);
      }
      gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, colour);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
    }
    bind();
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  };
  const bind = () => gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  const show = () => {
    const { canvas } = gl, same = canvas.width === width && canvas.height === height;
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, frame);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
    gl.blitFramebuffer(0, 0, width, height, 0, 0, canvas.width, canvas.height, gl.COLOR_BUFFER_BIT, same ? gl.NEAREST : gl.LINEAR);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  };
  return { begin, bind, show };
}
