// Reads the binary messages that stream.py writes; its docstring gives their layout.

export const ROW_WIDTH = 12;
export const CONTACT_WIDTH = 7;
export const CELL_WIDTH = 4;
export const PUSHABLE = 1, RESTING = 2, UNLIT = 4, GROUND = 8, SHADOWLESS = 16;

const MESH = 1, HEIGHTS = 2, FRAME = 3;
const FRAME_WORDS = 6, VIEW_FLOATS = 14;

export function decode(buffer) {
  const words = new Uint32Array(buffer, 0, Math.min(3, buffer.byteLength >> 2));
  if (words[0] === MESH) return decodeMesh(buffer, words[1], words[2]);
  if (words[0] === HEIGHTS) return { kind: "heights", number: words[1], heights: new Float32Array(buffer, 8) };
  if (words[0] === FRAME) return decodeFrame(buffer);
  throw new Error(`a message of unknown kind ${words[0]}`);
}

function decodeMesh(buffer, number, headLength) {
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 12, headLength)));
  let offset = 12 + headLength;
  const take = (Type, length) => {
    const array = new Type(buffer, offset, length);
    offset += 4 * length;
    return array;
  };
  return {
    kind: "mesh",
    number,
    ...head,
    positions: take(Float32Array, 3 * head.vertices),
    normals: take(Float32Array, 3 * head.vertices),
    colors: head.colors ? take(Float32Array, 4 * head.vertices) : null,
    faces: take(Uint32Array, 3 * head.faces),
  };
}

function decodeFrame(buffer) {
  const [, show, number, rows, contacts, cells] = new Uint32Array(buffer, 0, FRAME_WORDS);
  const view = new Float32Array(buffer, 4 * FRAME_WORDS, VIEW_FLOATS);
  let offset = 4 * (FRAME_WORDS + VIEW_FLOATS);
  const take = (count, width) => {
    const array = new Float32Array(buffer, offset, count * width);
    offset += 4 * count * width;
    return array;
  };
  return {
    kind: "frame",
    show,
    number,
    duration: view[0],
    eye: view.subarray(1, 4),
    target: view.subarray(4, 7),
    up: view.subarray(7, 10),
    fov: view[10],
    sun: view.subarray(11, 14),
    count: rows,
    rows: take(rows, ROW_WIDTH),
    contacts: take(contacts, CONTACT_WIDTH),
    cells: take(cells, CELL_WIDTH),
  };
}
