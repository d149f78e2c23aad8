// Block: the page's own bytes (docs/page-format.md): a header and named arrays behind base64 and deflate.

const MAGIC = "TILTVW01";
const HOLDS = { u8: Uint8Array, u16: Uint16Array, i32: Int32Array, f32: Float32Array, f64: Float64Array };

/** The block of the letters that stand in the page. */
export const openBlock = (text) => blockOf(Uint8Array.fromBase64 ? Uint8Array.fromBase64(text) : Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)));

/** {header, array}; array(name) decodes a column list: one typed array a column, in whole multiples of the scale. */
export async function blockOf(pressed) {
  const bytes = await inflated(pressed), decoder = new TextDecoder(), magic = decoder.decode(bytes.subarray(0, 8));
  if (magic !== MAGIC) throw new Error(`the page's data begin with ${magic}, not ${MAGIC}`);
  const end = 12 + new DataView(bytes.buffer).getUint32(8, true), header = JSON.parse(decoder.decode(bytes.subarray(12, end)));
  return { header, array: (name) => columnsOf(bytes.buffer, end, header.arrays[name]) };
}

async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

function columnsOf(buffer, start, told) {
  if (!told) return [new Int32Array(0)];
  const [count, width = 1] = told.shape, Holds = HOLDS[told.type], at = start + told.offset;
  if (told.coding === "delta") {
    return Array.from({ length: width }, (_, k) => {
      const planes = new Uint8Array(buffer, at + 4 * count * k, 4 * count);
      return summed(planes, new Holds(count));
    });
  }
  const flat = new Holds(buffer, at, count * width);
  if (width === 1) return [flat];
  return Array.from({ length: width }, (_, k) => Holds.from({ length: count }, (_, i) => flat[i * width + k]));
}

/** Running sums of zigzag differences whose bytes are sorted by weight. */
function summed(planes, out) {
  const n = out.length, second = 2 * n, third = 3 * n;
  let sum = 0;
  for (let i = 0; i < n; i++) {
    const word = planes[i] | (planes[n + i] << 8) | (planes[second + i] << 16) | (planes[third + i] << 24);
    sum += (word >>> 1) ^ -(word & 1);
    out[i] = sum;
  }
  return out;
}
