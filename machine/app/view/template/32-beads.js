// Beads: every extruding row at its true width and height, one instance a slot, so that the slider is a count.
// Near: a prism of eight sides with a rounded shade, mitred where one bead follows the other, a blunt tip where it ends.
// Far: the two faces of a box that the eye can see, shaded as if their common edge were round.

const CLOSE_PIXELS = 3; // a bead this wide on the screen is drawn as a prism

const BEAD_HEAD = `
in vec3 before, start, end, after;
in vec2 sizeBefore, sizeTold, sizeAfter, vertical; // sizes: width and height, thousandths of mm
in vec4 colour;
uniform mat4 toClip, toEye;
uniform vec3 eye;
uniform int last;
uniform float share;
uniform vec4 tint;
uniform int firstSlot, stride;
flat out vec4 paint;
flat out int slot;
vec2 size;
vec3 unfolded(vec2 f) {
  vec3 v = vec3(f, 1.0 - abs(f.x) - abs(f.y));
  if (v.z < 0.0) v.xy = (1.0 - abs(v.yx)) * vec2(v.x < 0.0 ? -1.0 : 1.0, v.y < 0.0 ? -1.0 : 1.0);
  return normalize(v);
}
bool hidden() {
  paint = vec4(mix(colour.rgb, tint.rgb, tint.a), 1.0);
  size = sizeTold * 0.001;
  slot = firstSlot + gl_InstanceID * stride;
  return colour.a == 0.0 || size.x == 0.0 || start == end;
}
vec3 reached() { return gl_InstanceID == last ? mix(start, end, share) : end; }
`;

const BEAD_NEAR = `${BEAD_HEAD}
in vec4 corner; // which end, side of the flat middle, place on the round: across, up; which end 2, 3: the tips
out vec3 normal;
vec3 sideways(vec3 along, vec3 up) { return normalize(cross(along, up)); }
vec3 mitred(vec3 mine, vec3 other) {
  vec3 middle = normalize(mine + other);
  return middle / max(dot(middle, mine), 0.62);
}
void main() {
  if (hidden()) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); normal = vec3(0.0); return; }
  vec3 up = unfolded(vertical), stop = reached(), along = normalize(end - start), mine = sideways(along, up), across = mine;
  bool ending = mod(corner.x, 2.0) > 0.5, tip = corner.x > 1.5;
  vec3 here = ending ? stop : start, other = ending ? after - end : start - before;
  float neighbour = ending ? (gl_InstanceID == last ? 0.0 : sizeAfter.x) : sizeBefore.x;
  bool joined = neighbour > 0.0 && dot(other, other) > 0.0 && dot(normalize(other), along) > -0.3;
  if (joined) across = mitred(mine, sideways(normalize(other), up));
  float round = 0.5 * min(size.x, size.y), flat_ = max(0.5 * (size.x - size.y), 0.0);
  vec3 place = here - up * 0.5 * size.y + across * (corner.y * flat_ + corner.z * round) + up * corner.w * 0.5 * size.y;
  vec3 outward = ending ? along : -along;
  if (tip && !joined) place += outward * round * 0.7;
  vec3 n = tip ? outward : normalize(mine * (corner.y * 0.3 + corner.z * 0.75) + up * corner.w * 0.95);
  normal = mat3(toEye) * n;
  gl_Position = toClip * vec4(place, 1.0);
}`;

const BEAD_FAR = `${BEAD_HEAD}
in vec4 corner; // which end; across and up, 1: towards the eye; 0: the side's face, 1: the one above or below
uniform float roundness;
out vec3 normal;
void main() {
  if (hidden()) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); normal = vec3(0.0); return; }
  vec3 up = unfolded(vertical), along = normalize(end - start), side = normalize(cross(along, up));
  vec3 middle = (corner.x > 0.5 ? reached() : start) - up * 0.5 * size.y, sight = eye - middle;
  if (dot(sight, side) < 0.0) side = -side;
  vec3 over = dot(sight, up) < 0.0 ? -up : up;
  vec3 place = middle + 0.5 * (side * corner.y * size.x + over * corner.z * size.y) + along * (corner.x - 0.5) * 0.5 * size.y;
  vec3 flat_ = corner.w > 0.5 ? over : side, edge = normalize(side * (corner.y + 0.4) + over * (corner.z + 0.4));
  normal = mat3(toEye) * normalize(mix(flat_, edge, roundness));
  gl_Position = toClip * vec4(place, 1.0);
}`;

const BEAD_PAINT = `
flat in vec4 paint;
flat in int slot;
in vec3 normal;
uniform bool picking;
out vec4 colour;
${LIGHT}
void main() {
  if (picking) colour = vec4(slot & 255, (slot >> 8) & 255, (slot >> 16) & 255, (slot >> 24) & 255) / 255.0;
  else colour = vec4(lit(paint.rgb, normalize(normal)), 1.0);
}`;
/** The prism's eighteen corners and the tips, and its triangles. */
function prism() {
  const ring = [[1, 0, 1], [1, 1, 0.4], [1, 1, -0.4], [1, 0, -1], [-1, 0, -1], [-1, -1, -0.4], [-1, -1, 0.4], [-1, 0, 1]];
  const corners = [0, 1].flatMap((end) => ring.flatMap((place) => [end, ...place])).concat([2, 0, 0, 0, 3, 0, 0, 0]);
  const faces = ring.flatMap((_, k) => {
    const next = (k + 1) % 8;
    return [k, next, k + 8, next, next + 8, k + 8, 16, next, k, 17, k + 8, next + 8];
  });
  return { corners: new Float32Array(corners), faces: new Uint16Array(faces) };
}

/** The two faces of a box that look at the eye. */
function twoFaces() {
  const face = (w, places) => [0, 1].flatMap((end) => places.flatMap((place) => [end, ...place, w]));
  const corners = [...face(0, [[1, -1], [1, 1]]), ...face(1, [[1, 1], [-1, 1]])];
  return { corners: new Float32Array(corners), faces: new Uint16Array([0, 1, 2, 2, 1, 3, 4, 5, 6, 6, 5, 7]) };
}

function beadsOf(gl, path) {
  const buffers = {
    points: framedBuffer(gl, path.points, 12),
    sizes: framedBuffer(gl, path.sizes, 4),
    verticals: bufferOf(gl, path.verticals),
    colours: bufferOf(gl, 4 * path.slots, gl.DYNAMIC_DRAW),
  };
  const near = bodyOf(gl, BEAD_NEAR, prism(), buffers);
  const far = bodyOf(gl, BEAD_FAR, twoFaces(), buffers);
  const paint = (colours) => {
    gl.bindBuffer(gl.ARRAY_BUFFER, buffers.colours);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, colours);
  };
  /** seen: {toClip, toEye, eye, pixels: width of a usual bead}; ranges: [{first, end, tint}] of slots; moving: {slot, share} of the row under way. */
  const draw = (seen, ranges, moving, stride, picking) => {
    const body = seen.pixels > CLOSE_PIXELS ? near : far, { to } = body.program;
    body.program.use();
    gl.bindVertexArray(body.vao);
    gl.uniformMatrix4fv(to("toClip"), false, seen.toClip);
    gl.uniformMatrix4fv(to("toEye"), false, seen.toEye);
    gl.uniform3fv(to("eye"), seen.eye);
    gl.uniform1f(to("roundness"), clamp(seen.pixels / CLOSE_PIXELS - 0.25, 0, 1));
    gl.uniform1i(to("picking"), picking ? 1 : 0);
    gl.uniform1f(to("share"), moving.share);
    gl.uniform1i(to("stride"), stride);
    for (const { first, end, tint } of ranges) {
      if (end <= first) continue;
      body.point(first, stride);
      gl.uniform1i(to("firstSlot"), first);
      gl.uniform1i(to("last"), stride === 1 ? moving.slot - first : -1);
      gl.uniform4fv(to("tint"), tint);
      gl.drawElementsInstanced(gl.TRIANGLES, body.indices, gl.UNSIGNED_SHORT, 0, Math.ceil((end - first) / stride));
    }
    gl.bindVertexArray(null);
  };
  return { paint, draw };
}

/** One shape of a bead: its program, its corners, and the instances' attributes from any slot on. */
function bodyOf(gl, vertex, shape, { points, sizes, verticals, colours }) {
  const program = programOf(gl, vertex, BEAD_PAINT), vao = gl.createVertexArray();
  gl.bindVertexArray(vao);
  bufferOf(gl, shape.faces, gl.STATIC_DRAW, gl.ELEMENT_ARRAY_BUFFER);
  bufferOf(gl, shape.corners);
  gl.enableVertexAttribArray(program.at("corner"));
  gl.vertexAttribPointer(program.at("corner"), 4, gl.FLOAT, false, 0, 0);
  const instanced = [
    ["before", points, 3, gl.FLOAT, false, 12, 0], ["start", points, 3, gl.FLOAT, false, 12, 1],
    ["end", points, 3, gl.FLOAT, false, 12, 2], ["after", points, 3, gl.FLOAT, false, 12, 3],
    ["sizeBefore", sizes, 2, gl.UNSIGNED_SHORT, false, 4, 0], ["sizeTold", sizes, 2, gl.UNSIGNED_SHORT, false, 4, 1],
    ["sizeAfter", sizes, 2, gl.UNSIGNED_SHORT, false, 4, 2], ["vertical", verticals, 2, gl.SHORT, true, 4, 0],
    ["colour", colours, 4, gl.UNSIGNED_BYTE, true, 4, 0],
  ].filter(([name]) => program.at(name) >= 0);
  for (const [name] of instanced) {
    gl.enableVertexAttribArray(program.at(name));
    gl.vertexAttribDivisor(program.at(name), 1);
  }
  gl.bindVertexArray(null);
  const point = (first, stride) => {
    for (const [name, buffer, count, type, normalized, bytes, ahead] of instanced) {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.vertexAttribPointer(program.at(name), count, type, normalized, bytes * stride, bytes * (first + ahead));
    }
  };
  return { program, vao, point, indices: shape.faces.length };
}
