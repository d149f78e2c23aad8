// Beads: every extruding row at its true width and height, in the order of the print, so that the slider is a count.
// Near: a prism of eight sides with a rounded shade, mitred where one bead follows the other, a blunt tip where it ends.
// Far: the two faces of a box that the eye can see, shaded as if their common edge were round.

const AT_ONCE = 4096; // beads in one draw
const CLOSE_PIXELS = 3; // a bead this wide on the screen is drawn as a prism

// One vertex finds its own row: corners are numbered through, so many to a bead. Faster than instances, which cost as much as
// a draw of their own on some cards and on all processors.
const BEAD_HEAD = `
in vec4 corner;
uniform highp sampler2D points;
uniform highp usampler2D sizes; // width and height, thousandths of mm; beads in a row from here on; slots until the next bead
uniform highp isampler2D verticals;
uniform lowp sampler2D colours;
uniform mat4 toClip, toEye;
uniform vec3 eye;
uniform vec4 tint;
uniform int first, behind, stride, corners, last; // behind: the first slot that is not drawn
uniform float share;
flat out vec4 paint;
flat out int slot;
out vec3 normal;
vec3 start, end, stop, up, along;
vec2 size;
ivec2 texel(int k) { return ivec2(k & ${TEXELS - 1}, k >> ${Math.log2(TEXELS)}); }
vec3 point(int k) { return texelFetch(points, texel(k), 0).xyz; }
vec2 sizeOf(int k) { return k < 0 ? vec2(0.0) : vec2(texelFetch(sizes, texel(k), 0).xy) * 0.001; }
vec3 unfolded(vec2 f) {
  vec3 v = vec3(f, 1.0 - abs(f.x) - abs(f.y));
  if (v.z < 0.0) v.xy = (1.0 - abs(v.yx)) * vec2(v.x < 0.0 ? -1.0 : 1.0, v.y < 0.0 ? -1.0 : 1.0);
  return normalize(v);
}
int next; // the slot after the bead
/** Takes the bead's values; false where nothing is to be drawn. With a stride, the first beads of so many rows as one. */
bool laid() {
  int begin = first + (gl_VertexID / corners) * stride, most = min(begin + stride, behind);
  slot = min(begin + int(texelFetch(sizes, texel(begin), 0).w), most - 1);
  next = min(slot + max(int(texelFetch(sizes, texel(slot), 0).z), 1), most);
  size = sizeOf(slot);
  vec4 colour = texelFetch(colours, texel(slot), 0);
  start = point(slot);
  end = point(next);
  if (colour.a == 0.0 || size.x == 0.0 || start == end) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    return false;
  }
  paint = vec4(mix(colour.rgb, tint.rgb, tint.a), tint.a > 0.0 ? 0.0 : 1.0);
  stop = slot == last ? mix(start, end, share) : end;
  up = unfolded(vec2(texelFetch(verticals, texel(slot), 0).xy) / 32767.0);
  along = normalize(end - start);
  return true;
}
`;

const BEAD_NEAR = `${BEAD_HEAD}
// corner: which end, side of the flat middle, place on the round across and up; ends 2, 3: the tips
vec3 sideways(vec3 along, vec3 up) { return normalize(cross(along, up)); }
vec3 mitred(vec3 mine, vec3 other) {
  vec3 middle = normalize(mine + other);
  return middle / max(dot(middle, mine), 0.62);
}
void main() {
  if (!laid()) return;
  vec3 mine = sideways(along, up), across = mine;
  bool ending = mod(corner.x, 2.0) > 0.5, tip = corner.x > 1.5;
  vec3 here = ending ? stop : start, other = vec3(0.0);
  int beside = ending ? next : slot - 1;
  if (sizeOf(beside).x > 0.0 && !(ending && slot == last)) other = point(beside + 1) - point(beside);
  bool joined = dot(other, other) > 0.0 && dot(normalize(other), along) > -0.3;
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
// corner: which end; across and up, 1: towards the eye; 0: the side's face, 1: the one above or below
uniform float roundness;
void main() {
  if (!laid()) return;
  vec3 side = normalize(cross(along, up)), middle = (corner.x > 0.5 ? stop : start) - up * 0.5 * size.y, sight = eye - middle;
  if (dot(sight, side) < 0.0) side = -side;
  vec3 over = dot(sight, up) < 0.0 ? -up : up;
  vec3 place = middle + 0.5 * (side * corner.y * size.x + over * corner.z * size.y) + along * (corner.x - 0.5) * 0.5 * size.y;
  vec3 flat_ = corner.w > 0.5 ? over : side, edge = normalize(side * (corner.y + 0.4) + over * (corner.z + 0.4));
  normal = mat3(toEye) * normalize(mix(flat_, edge, roundness));
  gl_Position = toClip * vec4(place, 1.0);
}`;

const BEAD_PAINT = `
flat in vec4 paint; // a: 0 for what is drawn faint, with gaps to look through
flat in int slot;
in vec3 normal;
uniform bool picking;
out vec4 colour;
${LIGHT}
void main() {
  if (paint.a == 0.0 && (int(gl_FragCoord.x) + int(gl_FragCoord.y)) % 3 != 0) discard;
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
  const textures = {
    points: texture(gl, gl.RGB32F, gl.RGB, gl.FLOAT, path.points, 3),
    sizes: texture(gl, gl.RGBA16UI, gl.RGBA_INTEGER, gl.UNSIGNED_SHORT, path.sizes, 4),
    verticals: texture(gl, gl.RG16I, gl.RG_INTEGER, gl.SHORT, path.verticals, 2),
    colours: texture(gl, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4 * path.texels), 4),
  };
  const near = bodyOf(gl, BEAD_NEAR, prism()), far = bodyOf(gl, BEAD_FAR, twoFaces());
  const paint = (colours) => {
    gl.bindTexture(gl.TEXTURE_2D, textures.colours);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, TEXELS, colours.length / 4 / TEXELS, gl.RGBA, gl.UNSIGNED_BYTE, colours);
  };
  /**
   * seen: {toClip, toEye, eye, pixels: width of a usual bead}; ranges: [{first, end, tint}] of slots; moving: {slot, share} of
   * the row under way; stride: 1, or only every second, third ... bead.
   */
  const draw = (seen, ranges, moving, stride, picking = false) => {
    const body = seen.pixels > CLOSE_PIXELS ? near : far, { to } = body.program;
    body.program.use();
    gl.bindVertexArray(body.vao);
    Object.entries(textures).forEach(([name, held], unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, held);
      gl.uniform1i(to(name), unit);
    });
    gl.uniformMatrix4fv(to("toClip"), false, seen.toClip);
    gl.uniformMatrix4fv(to("toEye"), false, seen.toEye);
    gl.uniform3fv(to("eye"), seen.eye);
    gl.uniform1f(to("roundness"), clamp(seen.pixels / CLOSE_PIXELS - 0.25, 0, 1));
    gl.uniform1i(to("picking"), picking ? 1 : 0);
    gl.uniform1i(to("last"), moving.slot);
    gl.uniform1f(to("share"), moving.share);
    gl.uniform1i(to("stride"), stride);
    gl.uniform1i(to("corners"), body.corners);
    for (const { first, end, tint } of ranges) {
      gl.uniform4fv(to("tint"), tint);
      gl.uniform1i(to("behind"), end);
      for (let from = first; from < end; from += AT_ONCE * stride) {
        gl.uniform1i(to("first"), from);
        const beads = Math.min(Math.ceil((end - from) / stride), AT_ONCE);
        gl.drawElements(gl.TRIANGLES, beads * body.indices, gl.UNSIGNED_INT, 0);
      }
    }
    gl.bindVertexArray(null);
  };
  return { paint, draw };
}

/** Values by slot, TEXELS to a line. */
function texture(gl, inside, format, type, content, each) {
  const held = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, held);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
  gl.texImage2D(gl.TEXTURE_2D, 0, inside, TEXELS, content.length / each / TEXELS, 0, format, type, content);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  return held;
}

/** One shape of a bead: its program, and the corners and triangles of as many beads as are drawn at once. */
function bodyOf(gl, vertex, { corners, faces }) {
  const program = programOf(gl, vertex, BEAD_PAINT), vao = gl.createVertexArray(), each = corners.length / 4;
  const all = new Float32Array(corners.length * AT_ONCE), indices = new Uint32Array(faces.length * AT_ONCE);
  for (let bead = 0; bead < AT_ONCE; bead++) {
    all.set(corners, bead * corners.length);
    faces.forEach((corner, k) => { indices[bead * faces.length + k] = bead * each + corner; });
  }
  gl.bindVertexArray(vao);
  bufferOf(gl, indices, gl.STATIC_DRAW, gl.ELEMENT_ARRAY_BUFFER);
  attribute(gl, program.at("corner"), bufferOf(gl, all), 4, gl.FLOAT, false);
  gl.bindVertexArray(null);
  return { program, vao, corners: each, indices: faces.length };
}
