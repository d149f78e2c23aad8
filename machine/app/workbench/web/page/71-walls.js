// Walls: what is seen of the parts that are sliced, drawn as they become ready, over the faint model.

const PIECE = 7; // numbers of a straight piece: two ends and its height

/** Triangles {places, colours} of a part's walls: upright bands along every piece. bytes: as the server gives them. */
function bandsOf(bytes, colour) {
  const values = new Float32Array(bytes), way = values.subarray(0, 3), count = (values.length - 3) / PIECE;
  const places = new Float32Array(18 * count), colours = new Uint32Array(6 * count).fill(wordOf(rgb(colour), 254));
  for (let k = 0, at = 0; k < count; k++) {
    const begin = 3 + PIECE * k, half = values[begin + 6] / 2;
    for (const [end, sign] of [[0, -1], [3, -1], [3, 1], [0, -1], [3, 1], [0, 1]])
      for (let axis = 0; axis < 3; axis++) places[at++] = values[begin + end + axis] + sign * half * way[axis];
  }
  return { places, colours: new Uint8Array(colours.buffer) };
}

/** bench.showWalls(): the parts of the slices that are made, or lie there and are not out of date, while the slices are looked at. */
function wallsOf(bench) {
  const bands = new Map(); // of parts, as soon as they have come
  let number = 0;
  const slices = () => {
    const { slicing, sliced } = bench.state;
    return slicing || (sliced && !sliced.stale ? sliced : null);
  };
  const shown = () => bench.tab === "slices" && bench.triangles && slices() && bands.size > 0;
  const show = () => {
    if (bench.picture) bench.picture.walls(shown() ? [...bands.values()].filter(Boolean) : null);
    document.documentElement.dataset.walls = shown() ? [...bands.keys()].sort((a, b) => a - b).join(" ") : "";
  };
  const fetchPart = async (part, of) => {
    bands.set(part, null);
    const answer = await fetch(`walls/${of}/${part}`);
    if (!answer.ok || number !== of) return;
    bands.set(part, bandsOf(await answer.arrayBuffer(), bench.state.colours[part - 1] || PLAIN));
    show();
  };
  bench.showWalls = () => {
    const now = slices();
    if (!bench.picture || bench.tab !== "slices" || !now) return show();
    if (now.number !== number) {
      number = now.number;
      bands.clear();
    }
    now.ready.filter((part) => !bands.has(part)).forEach((part) => fetchPart(part, number));
    show();
  };
}
