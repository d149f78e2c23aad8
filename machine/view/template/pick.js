// Pick: which bead is under a place of the picture.

/** The slot of the bead at a place of the picture, or -1: one pixel drawn with numbers for colours. */
export function slotAt(gl, stage, { beads, ranges }, [x, y]) {
  if (!stage.beads || !ranges.length) return -1;
  const { width, height } = gl.canvas, frame = gl.createFramebuffer(), byte = new Uint8Array(4);
  const target = (format, place) => {
    const store = gl.createRenderbuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, store);
    gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, store);
    return store;
  };
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  const stores = [target(gl.RGBA8, gl.COLOR_ATTACHMENT0), target(gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT)];
  gl.enable(gl.SCISSOR_TEST);
  gl.scissor(x, y, 1, 1);
  gl.clearColor(1, 1, 1, 1);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  stage.beads.draw(beads, ranges, { slot: -1, share: 1 }, true);
  gl.readPixels(x, y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, byte);
  gl.disable(gl.SCISSOR_TEST);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.deleteFramebuffer(frame);
  stores.forEach((store) => gl.deleteRenderbuffer(store));
  const slot = byte[0] | (byte[1] << 8) | (byte[2] << 16) | (byte[3] << 24);
  return slot;
}
