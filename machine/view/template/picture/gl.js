// GL: programs, buffers, frames that are drawn before they are shown, and the lighting that all drawings share.

import { notice } from "../elements.js";

export const LIGHT = `
vec3 lit(vec3 colour, vec3 n) {
  float key = max(dot(n, normalize(vec3(-0.45, 0.55, 0.75))), 0.0);
  float fill = max(dot(n, normalize(vec3(0.7, -0.15, 0.5))), 0.0);
  float gloss = pow(max(dot(n, normalize(vec3(-0.25, 0.35, 1.0))), 0.0), 24.0);
  return colour * (0.42 + 0.58 * key + 0.24 * fill) + vec3(0.07 * gloss);
}`;

const CARD = { alpha: true, antialias: false, depth: false, powerPreference: "high-performance" }; // frames provide what is disabled here

/** The WebGL2 context of a canvas, null where there is none. */
export const cardOf = (canvas) => canvas.getContext("webgl2", CARD);

export const density = () => Math.min(devicePixelRatio || 1, 2);

/** Width and height of a picture, in pixels, as a share of its canvas. */
export const sizeOf = ({ clientWidth, clientHeight }, share = 1) => [clientWidth, clientHeight].map((x) => Math.max(Math.round(x * density() * share), 1));

/** Whether a canvas lacks the pixels that it should have. */
export const outgrown = (canvas) => sizeOf(canvas).some((x, k) => x !== [canvas.width, canvas.height][k]);

const PROGRAMS = new WeakMap(); // by context: a program is compiled once, however often it is used

export function programOf(gl, vertex, fragment) {
  if (!PROGRAMS.has(gl)) PROGRAMS.set(gl, new Map());
  const made = PROGRAMS.get(gl), name = vertex + fragment;
  if (!made.has(name)) made.set(name, linked(gl, vertex, fragment));
  return made.get(name);
}

/** A program {use, set: values of uniforms by their names, at: location of an attribute}; the card compiles it while the page continues. */
function linked(gl, vertex, fragment) {
  const program = gl.createProgram();
  const shaders = [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]].map(([kind, text]) => {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, `#version 300 es\nprecision highp float;\nprecision highp int;\n${text}`);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    return shader;
  });
  gl.linkProgram(program);
  let setters = null;
  /** Throw the compiler's errors when the program is first used: an earlier query would wait. */
  const ready = () => {
    if (!setters && !gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost())
      throw new Error(shaders.map((shader) => gl.getShaderInfoLog(shader)).join("") || gl.getProgramInfoLog(program));
    setters ||= settersOf(gl, program);
    return program;
  };
  const set = (values) => Object.entries(values).forEach(([name, value]) => setters[name]?.(value));
  return { use: () => gl.useProgram(ready()), set, at: (name) => gl.getAttribLocation(ready(), name) };
}

/** Setters of a program's uniforms, by their types in the program. */
function settersOf(gl, program) {
  const calls = { [gl.FLOAT]: "uniform1f", [gl.FLOAT_VEC3]: "uniform3fv", [gl.FLOAT_VEC4]: "uniform4fv" }; // other types are integers
  const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) || 0;
  return Object.fromEntries(Array.from({ length: count }, (_, k) => {
    const { name, type } = gl.getActiveUniform(program, k), place = gl.getUniformLocation(program, name), call = calls[type] || "uniform1i";
    return [name.replace("[0]", ""), type === gl.FLOAT_MAT4 ? (value) => gl.uniformMatrix4fv(place, false, value) : (value) => gl[call](place, value)];
  }));
}

/** Vertices on the card {draw(uniforms, calls()), put(name, content), free}. attributes: {name: [content, numbers for each vertex]}, bytes are shares of 255; indices: of the vertices of the triangles. */
export function cornersOn(gl, program, attributes, indices = null) {
  const array = gl.createVertexArray(), buffers = {};
  const filled = (target, content) => {
    const buffer = gl.createBuffer();
    gl.bindBuffer(target, buffer);
    gl.bufferData(target, content, gl.STATIC_DRAW);
    return buffer;
  };
  gl.bindVertexArray(array);
  if (indices) buffers.indices = filled(gl.ELEMENT_ARRAY_BUFFER, indices);
  for (const [name, [content, numbers]] of Object.entries(attributes)) {
    const place = program.at(name), bytes = content instanceof Uint8Array;
    buffers[name] = filled(gl.ARRAY_BUFFER, content);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, numbers, bytes ? gl.UNSIGNED_BYTE : gl.FLOAT, bytes, 0, 0);
  }
  gl.bindVertexArray(null);
  const draw = (values, calls) => {
    program.use();
    program.set(values);
    gl.bindVertexArray(array);
    calls();
    gl.bindVertexArray(null);
  };
  const put = (name, content) => {
    gl.bindBuffer(gl.ARRAY_BUFFER, buffers[name]);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, content);
  };
  /** Free the card's memory at once, since a page that is open all day would wait for the garbage collector. */
  const free = () => {
    gl.deleteVertexArray(array);
    Object.values(buffers).forEach((buffer) => gl.deleteBuffer(buffer));
  };
  return { draw, put, free };
}

/** Build the picture now, and again when the context is restored: the card may take its memory back at any time. */
export function outlive(gl, drop, build) {
  gl.canvas.addEventListener("webglcontextlost", (event) => {
    event.preventDefault();
    PROGRAMS.delete(gl);
    drop();
    notice("The graphics card has let go of the picture; it returns as soon as the card is ready.", "card");
  });
  const begin = () => {
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    build();
    notice("", "card");
  };
  gl.canvas.addEventListener("webglcontextrestored", begin);
  begin();
}

/** A framebuffer in which a picture is drawn before it is shown, so that the last one stays visible meanwhile: {begin(width, height), bind, show, free}. */
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
  const free = () => {
    gl.deleteFramebuffer(frame);
    [colour, depth].forEach((store) => gl.deleteRenderbuffer(store));
  };
  return { begin, bind, show, free };
}
