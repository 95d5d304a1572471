/** The outline of a mesh: the edges that belong to one cell only, joined to closed lines. */

/** Closed lines of mesh vertices; the first vertex of each is repeated at its end. */
export function outlineOf(cells: Uint32Array): number[][] {
    const open = new Map<string, [number, number]>();
    for (let cell = 0; cell < cells.length; cell += 3) {
        for (let side = 0; side < 3; side++) {
            const [a, b] = [cells[cell + side], cells[cell + ((side + 1) % 3)]];
            const key = a < b ? `${a} ${b}` : `${b} ${a}`;
            if (!open.delete(key)) open.set(key, [a, b]);
        }
    }
    const neighbours = new Map<number, number[]>();
    for (const [a, b] of open.values()) {
        neighbours.set(a, [...(neighbours.get(a) ?? []), b]);
        neighbours.set(b, [...(neighbours.get(b) ?? []), a]);
    }
    const lines: number[][] = [];
    const seen = new Set<number>();
    for (const first of neighbours.keys()) {
        if (seen.has(first)) continue;
        const line = [first];
        for (let here: number | undefined = first; here !== undefined; ) {
            seen.add(here);
            here = neighbours.get(here)?.find((vertex) => !seen.has(vertex));
            if (here !== undefined) line.push(here);
        }
        lines.push([...line, first]);
    }
    return lines;
}
