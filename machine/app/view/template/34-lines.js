// Lines: the ways of the tip while nothing is laid, and the edges of bodies.

const LINE_VERTEX = `
in vec3 place;
in vec4 colour;
uniform mat4 toClip;
uniform float nearer;
out vec4 paint;
void main() {
  paint = colour;
  gl_Position = toClip * vec4(place, 1.0);
  gl_Position.z -= nearer * gl_Position.w;
}`;
const LINE_FRAGMENT = `
in vec4 paint;
out vec4 colour;
void main() { colour = vec4(paint.rgb * paint.a, paint.a); }`;

const WAYS = { [KIND.travel]: [76, 126, 196, 200], [KIND.rotate]: [224, 122, 32, 235], [KIND.wipe]: [140, 112, 190, 200], [KIND.retract]: [76, 126, 196, 200], [KIND.prime]: [76, 126, 196, 200] };
const TURN_STEP_DEG = 3;

function linesOf(gl, { places, colours }) {
  const program = programOf(gl, LINE_VERTEX, LINE_FRAGMENT), vao = gl.createVertexArray();
  gl.bindVertexArray(vao);
  for (const [name, content, count, type, normalized] of [["place", places, 3, gl.FLOAT, false], ["colour", colours, 4, gl.UNSIGNED_BYTE, true]]) {
    bufferOf(gl, content);
    gl.enableVertexAttribArray(program.at(name));
    gl.vertexAttribPointer(program.at(name), count, type, normalized, 0, 0);
  }
  gl.bindVertexArray(null);
  const count = places.length / 3;
  const draw = (toClip, first = 0, end = count, nearer = 0) => {
    if (end <= first) return;
    program.use();
    gl.bindVertexArray(vao);
    gl.uniformMatrix4fv(program.to("toClip"), false, toClip);
    gl.uniform1f(program.to("nearer"), nearer);
    gl.drawArrays(gl.LINES, first, end - first);
    gl.bindVertexArray(null);
  };
  return { draw, corners: count };
}

/** Pairs of places for every row that moves and lays nothing; turns of the table are arcs. row: of each pair, rising. */
function waysOf(rows, path, chain) {
  const places = [], colours = [], row = [], point = [0, 0, 0];
  const place = workpieceOf(chain), p = path.points;
  const pair = (i, a, b) => { places.push(...a, ...b); colours.push(...WAYS[rows.kind[i]], ...WAYS[rows.kind[i]]); row.push(i); };
  for (let i = 0; i < rows.count; i++) {
    if (rows.kind[i] === KIND.extrude) continue;
    const s = 3 * path.slot(i), first = [p[s], p[s + 1], p[s + 2]], end = [p[s + 3], p[s + 4], p[s + 5]];
    const [from, to] = rows.kind[i] === KIND.rotate ? [placeAt(rows, i, 0), placeAt(rows, i, 1)] : [null, null];
    if (!from) {
      if (length(sub(first, end)) > 0) pair(i, first, end);
      continue;
    }
    const steps = Math.min(Math.ceil(Math.max(Math.abs(to[3] - from[3]), Math.abs(to[4] - from[4])) / TURN_STEP_DEG), 360);
    let here = first;
    for (let k = 1; k <= steps; k++) {
      place(...from.map((value, axis) => mix(value, to[axis], k / steps)), point, 0);
      pair(i, here, point);
      here = [...point];
    }
  }
  return { places: new Float32Array(places), colours: new Uint8Array(colours), row: Int32Array.from(row) };
}
