/** A camera over the plane: its centre in µm and how many µm a CSS pixel is. y points up. */

/** The part of the plane that is seen. */
export interface Camera {
    x: number;
    y: number;
    /** µm a CSS pixel. */
    scale: number;
}

/** Width and height in CSS pixels. */
export interface Size {
    width: number;
    height: number;
}

/** The camera that sees a whole box with a margin of a few per cent. */
export function fitting([x0, y0, x1, y1]: [number, number, number, number], size: Size): Camera {
    const scale = Math.max((x1 - x0) / Math.max(size.width, 1), (y1 - y0) / Math.max(size.height, 1)) * 1.06;
    return { x: (x0 + x1) / 2, y: (y0 + y1) / 2, scale };
}

/** The point under a pixel (from the upper left corner). */
export function pointAt(camera: Camera, size: Size, [px, py]: [number, number]): [number, number] {
    return [camera.x + (px - size.width / 2) * camera.scale, camera.y - (py - size.height / 2) * camera.scale];
}

/** The pixel of a point. */
export function pixelOf(camera: Camera, size: Size, [x, y]: [number, number]): [number, number] {
    return [(x - camera.x) / camera.scale + size.width / 2, (camera.y - y) / camera.scale + size.height / 2];
}

/** Zooms by a factor (above 1: nearer) so that the point under a pixel stays there; between 1/50 and 4 times `fitted`. */
export function zoomed(camera: Camera, size: Size, pixel: [number, number], factor: number, fitted: number): Camera {
    const scale = Math.min(Math.max(camera.scale / factor, fitted / 50), fitted * 4);
    const [x, y] = pointAt(camera, size, pixel);
    const share = scale / camera.scale;
    return { x: x + (camera.x - x) * share, y: y + (camera.y - y) * share, scale };
}
