// GL: programs, buffers and the light that all drawing shares.

const LIGHT = `
vec3 lit(vec3 colour, vec3 n) {
  float key = max(dot(n, normalize(vec3(-0.45, 0.55, 0.75))), 0.0);
  float fill = max(dot(n, normalize(vec3(0.7, -0.15, 0.5))), 0.0);
  float gloss = pow(max(dot(n, normalize(vec3(-0.25, 0.35, 1.0))), 0.0), 24.0);
  return colour * (0.42 + 0.58 * key + 0.24 * fill) + vec3(0.07 * gloss);
}`;

const PROGRAMS = new WeakMap(); // of each context: a program is made once, however many things are drawn with it

const forgetPrograms = (gl) => PROGRAMS.set(gl, new Map());

function programOf(gl, vertex, fragment) {
  const made = PROGRAMS.get(gl), name = vertex + fragment;
  if (!made.has(name)) made.set(name, linked(gl, vertex, fragment));
  return made.get(name);
}

/** A linked program {use, at: place of an attribute, to: place of a uniform}. Raises what the compiler says. */
function linked(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, `#version 300 es\nprecision highp float;\nprecision highp int;\n${text}`);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) throw new Error(gl.getShaderInfoLog(shader));
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(program));
  const places = new Map();
  const to = (name) => {
    if (!places.has(name)) places.set(name, gl.getUniformLocation(program, name));
    return places.get(name);
  };
  return { use: () => gl.useProgram(program), at: (name) => gl.getAttribLocation(program, name), to };
}

function bufferOf(gl, content, usage = gl.STATIC_DRAW, target = gl.ARRAY_BUFFER) {
  const buffer = gl.createBuffer();
  gl.bindBuffer(target, buffer);
  gl.bufferData(target, content, usage);
  return buffer;
}

/** The bound vertex array takes an attribute from a buffer. */
function attribute(gl, place, buffer, count, type, normalized) {
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.enableVertexAttribArray(place);
  gl.vertexAttribPointer(place, count, type, normalized, 0, 0);
}
