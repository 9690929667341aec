/** Files in one .zip, stored as they are: the formats that need it are compressed already, and browsers save one file. */
export interface Entry {
  name: string;
  content: Uint8Array;
}

const LOCAL = 0x04034b50;
const CENTRAL = 0x02014b50;
const END = 0x06054b50;
const UTF8_NAMES = 0x0800;
/** 1 January 1980: archives of the same files are the same. */
const DATE = 0x21;

const TABLE = Uint32Array.from({ length: 256 }, (_, n) => {
  let value = n;
  for (let bit = 0; bit < 8; bit++) value = value & 1 ? 0xedb88320 ^ (value >>> 1) : value >>> 1;
  return value >>> 0;
});

export function crc32(data: Uint8Array): number {
  let sum = 0xffffffff;
  for (const byte of data) sum = (TABLE[(sum ^ byte) & 255] ?? 0) ^ (sum >>> 8);
  return (sum ^ 0xffffffff) >>> 0;
}

function header(size: number, fields: [number, number, 2 | 4][]): Uint8Array {
  const made = new Uint8Array(size);
  const view = new DataView(made.buffer);
  for (const [at, value, width] of fields) {
    if (width === 2) view.setUint16(at, value, true);
    else view.setUint32(at, value, true);
  }
  return made;
}

export function zip(entries: readonly Entry[]): Uint8Array[] {
  const parts: Uint8Array[] = [];
  const directory: Uint8Array[] = [];
  let at = 0;
  for (const { name, content } of entries) {
    const text = new TextEncoder().encode(name);
    const sum = crc32(content);
    const local = header(30, [
      [0, LOCAL, 4],
      [4, 20, 2],
      [6, UTF8_NAMES, 2],
      [12, DATE, 2],
      [14, sum, 4],
      [18, content.length, 4],
      [22, content.length, 4],
      [26, text.length, 2],
    ]);
    directory.push(
      header(46, [
        [0, CENTRAL, 4],
        [4, 20, 2],
        [6, 20, 2],
        [8, UTF8_NAMES, 2],
        [14, DATE, 2],
        [16, sum, 4],
        [20, content.length, 4],
        [24, content.length, 4],
        [28, text.length, 2],
        [42, at, 4],
      ]),
      text,
    );
    parts.push(local, text, content);
    at += local.length + text.length + content.length;
  }
  const size = directory.reduce((sum, part) => sum + part.length, 0);
  const count = entries.length;
  return [
    ...parts,
    ...directory,
    header(22, [
      [0, END, 4],
      [8, count, 2],
      [10, count, 2],
      [12, size, 4],
      [16, at, 4],
    ]),
  ];
}
