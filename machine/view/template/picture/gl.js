// GL: programs, buffers, frames that are drawn before they are shown, and the light that all drawing shares.

import { notice } from "../elements.js";

export const LIGHT = `
vec3 lit(vec3 colour, vec3 n) {
  float key = max(dot(n, normalize(vec3(-0.45, 0.55, 0.75))), 0.0);
  float fill = max(dot(n, normalize(vec3(0.7, -0.15, 0.5))), 0.0);
  float gloss = pow(max(dot(n, normalize(vec3(-0.25, 0.35, 1.0))), 0.0), 24.0);
  return colour * (0.42 + 0.58 * key + 0.24 * fill) + vec3(0.07 * gloss);
}`;

const PROGRAMS = new WeakMap(); // of each context: a program is made once, however many things are drawn with it

export function programOf(gl, vertex, fragment) {
  if (!PROGRAMS.has(gl)) PROGRAMS.set(gl, new Map());
  const made = PROGRAMS.get(gl), name = vertex + fragment;
  if (!made.has(name)) made.set(name, linked(gl, vertex, fragment));
  return made.get(name);
}

/** A program {use, at: place of an attribute, to: place of a uniform}; the card compiles it while the page goes on. */
function linked(gl, vertex, fragment) {
  const program = gl.createProgram(), places = new Map();
  const shaders = [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]].map(([kind, text]) => {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, `#version 300 es\nprecision highp float;\nprecision highp int;\n${text}`);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    return shader;
  });
  gl.linkProgram(program);
  let checked = false;
  /** Raises what the compiler says, asked when the program is first needed: to ask sooner is to wait. */
  const ready = () => {
    if (!checked && !gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost())
      throw new Error(shaders.map((shader) => gl.getShaderInfoLog(shader)).join("") || gl.getProgramInfoLog(program));
    checked = true;
    return program;
  };
  const to = (name) => {
    if (!places.has(name)) places.set(name, gl.getUniformLocation(ready(), name));
    return places.get(name);
  };
  return { use: () => gl.useProgram(ready()), at: (name) => gl.getAttribLocation(ready(), name), to };
}

export function bufferOf(gl, content, usage = gl.STATIC_DRAW, target = gl.ARRAY_BUFFER) {
  const buffer = gl.createBuffer();
  gl.bindBuffer(target, buffer);
  gl.bufferData(target, content, usage);
  return buffer;
}

/** Gives the card's memory back at once: a page that is open all day would wait for the collector. */
export function freed(gl, vao, ...buffers) {
  gl.deleteVertexArray(vao);
  buffers.forEach((buffer) => gl.deleteBuffer(buffer));
}

/** The bound vertex array takes an attribute from a buffer. */
export function attribute(gl, place, buffer, count, type, normalized) {
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.enableVertexAttribArray(place);
  gl.vertexAttribPointer(place, count, type, normalized, 0, 0);
}

/** The graphics card may take its memory back at any time; the picture returns when it is given again. */
export function outlive(gl, drop, build) {
  gl.canvas.addEventListener("webglcontextlost", (event) => {
    event.preventDefault();
    PROGRAMS.delete(gl);
    drop();
    notice("The graphics card has let go of the picture; it returns as soon as the card is ready.", "card");
  });
  gl.canvas.addEventListener("webglcontextrestored", () => {
    build();
    notice("", "card");
  });
}

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
