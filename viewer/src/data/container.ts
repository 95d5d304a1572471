/**
 * The container of a recording: magic, JSON header, one zlib stream of arrays (docs/src/report.md tells its layout).
 * Everything that can be wrong with it becomes a {@link DamagedRecording} that says what and where.
 */

/** A recording that cannot be read; the message is meant for the reader of the page. */
export class DamagedRecording extends Error {
    override name = "DamagedRecording";
}

/** A typed array of any of the stored types. */
export type Items = Uint8Array | Uint16Array | Int16Array | Uint32Array | Float32Array;

/** What the header says of one array. */
export interface ArrayEntry {
    /** Bytes from the beginning of the inflated payload. */
    offset: number;
    /** Count of items. */
    length: number;
    /** Type of an item. */
    type: string;
    /** Extents, slowest first; their product is `length`. */
    shape: number[];
    /** `plain`, or `delta-planes`: differences of rows, low bytes first, then high bytes. */
    coding?: string;
}

const TYPES = { u8: Uint8Array, u16: Uint16Array, i16: Int16Array, u32: Uint32Array, f32: Float32Array } as const;
const MAGIC = "TROPREC1";

/** An opened container: its header and its arrays by name. */
export interface Container {
    /** The header, not yet checked beyond being an object. */
    header: Record<string, unknown>;
    /** The array of a name, decoded; null where the header does not name it. */
    array(name: string): Items | null;
    /** Extents of an array that exists. */
    shape(name: string): number[];
}

/** The bytes of text in base64. */
export function bytesOfBase64(text: string): Uint8Array<ArrayBuffer> {
    let binary: string;
    try {
        binary = atob(text.replace(/\s+/g, ""));
    } catch {
        throw new DamagedRecording("the recording in this page is not base64: the file was cut or changed");
    }
    const bytes = new Uint8Array(binary.length);
    for (let i = 0; i < binary.length; i++) bytes[i] = binary.charCodeAt(i);
    return bytes;
}

/** Opens a container: reads the header and inflates the payload with the browser's own zlib. */
export async function openContainer(bytes: Uint8Array<ArrayBuffer>): Promise<Container> {
    if (bytes.length < 12) throw new DamagedRecording(`the recording has ${bytes.length} bytes, too few for a header`);
    const magic = String.fromCharCode(...bytes.subarray(0, 8));
    if (magic !== MAGIC) throw new DamagedRecording(`the recording begins with "${magic}" in place of "${MAGIC}"`);
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    const end = 12 + view.getUint32(8, true);
    if (end > bytes.length) throw new DamagedRecording(`the header should end at byte ${end} of ${bytes.length}`);
    const header = parseHeader(new TextDecoder().decode(bytes.subarray(12, end)));
    const payload = await inflate(bytes.slice(Math.ceil(end / 8) * 8));
    const entries = header["arrays"] as Record<string, ArrayEntry>;
    return {
        header,
        array: (name) => (entries[name] ? readArray(name, entries[name], payload) : null),
        shape: (name) => entries[name]?.shape ?? [],
    };
}

function parseHeader(text: string): Record<string, unknown> {
    let header: unknown;
    try {
        header = JSON.parse(text);
    } catch (error) {
        throw new DamagedRecording(`the header of the recording is not JSON: ${(error as Error).message}`);
    }
    const isRecord = (value: unknown): value is Record<string, unknown> => typeof value === "object" && value !== null;
    if (!isRecord(header) || !isRecord(header["arrays"])) {
        throw new DamagedRecording("the header of the recording names no arrays");
    }
    if (header["version"] !== 1) {
        throw new DamagedRecording(`the recording has version ${String(header["version"])}; this page reads version 1`);
    }
    return header;
}

async function inflate(bytes: Uint8Array<ArrayBuffer>): Promise<ArrayBuffer> {
    try {
        const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
        return await new Response(stream).arrayBuffer();
    } catch {
        throw new DamagedRecording("the arrays of the recording cannot be inflated: the file was cut or changed");
    }
}

function readArray(name: string, entry: ArrayEntry, payload: ArrayBuffer): Items {
    const type = TYPES[entry.type as keyof typeof TYPES];
    if (!type) throw new DamagedRecording(`array ${name}: type "${entry.type}" is none of ${Object.keys(TYPES).join(", ")}`);
    const items = entry.shape.reduce((product, extent) => product * extent, 1);
    if (items !== entry.length) {
        throw new DamagedRecording(`array ${name}: shape ${entry.shape.join(" x ")} holds ${items} items, not ${entry.length}`);
    }
    const bytes = entry.length * type.BYTES_PER_ELEMENT;
    if (entry.offset % 8 !== 0 || entry.offset + bytes > payload.byteLength) {
        throw new DamagedRecording(`array ${name}: bytes ${entry.offset} to ${entry.offset + bytes} of ${payload.byteLength}`);
    }
    const coding = entry.coding ?? "plain";
    if (coding === "plain") return new type(payload, entry.offset, entry.length);
    if (coding === "delta-planes" && type === Uint16Array) {
        const row = entry.shape.slice(1).reduce((product, extent) => product * extent, 1);
        return joinDeltaPlanes(new Uint8Array(payload, entry.offset, bytes), row);
    }
    throw new DamagedRecording(`array ${name}: coding "${coding}" of ${entry.type} is unknown`);
}

/** Undoes `delta-planes`: joins low and high bytes and sums the rows of `row` items modulo 65536. */
export function joinDeltaPlanes(planes: Uint8Array, row: number): Uint16Array {
    const count = planes.length / 2;
    const items = new Uint16Array(count);
    for (let i = 0; i < count; i++) {
        const difference = planes[i] | (planes[count + i] << 8);
        items[i] = i < row ? difference : items[i - row] + difference;
    }
    return items;
}
