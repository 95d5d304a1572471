/** Mouse, touch and wheel on the stage: drag and pinch move the view, a short touch chooses, hovering looks. */

/** What gestures do; pixels are from the upper left corner of the canvas' page position (client coordinates). */
export interface Gestures {
    pan(dx: number, dy: number): void;
    zoom(at: [number, number], factor: number): void;
    hover(at: [number, number] | null): void;
    choose(at: [number, number]): void;
}

/** Distance in pixels below which a press is a choice and not a drag. */
const STILL = 5;

/** Listens on an element. */
export function listen(element: HTMLElement, gestures: Gestures): void {
    const pressed = new Map<number, [number, number]>();
    let travelled = 0;
    element.addEventListener("pointerdown", (event) => {
        if (event.button !== 0) return;
        element.setPointerCapture(event.pointerId);
        if (pressed.size === 0) travelled = 0;
        pressed.set(event.pointerId, [event.clientX, event.clientY]);
    });
    element.addEventListener("pointermove", (event) => {
        const before = pressed.get(event.pointerId);
        const now: [number, number] = [event.clientX, event.clientY];
        if (!before) return void (event.pointerType !== "touch" && gestures.hover(now));
        const other = [...pressed].find(([id]) => id !== event.pointerId)?.[1];
        const moved: [number, number] = [now[0] - before[0], now[1] - before[1]];
        travelled += Math.hypot(...moved);
        pressed.set(event.pointerId, now);
        if (other) {
            const factor = distance(now, other) / Math.max(distance(before, other), 1);
            gestures.pan(moved[0] / 2, moved[1] / 2);
            gestures.zoom([(now[0] + other[0]) / 2, (now[1] + other[1]) / 2], factor);
        } else if (travelled > STILL) {
            gestures.hover(null);
            gestures.pan(...moved);
        }
    });
    const release = (event: PointerEvent): void => {
        const was = pressed.delete(event.pointerId);
        if (was && event.type === "pointerup" && pressed.size === 0 && travelled <= STILL) gestures.choose([event.clientX, event.clientY]);
    };
    element.addEventListener("pointerup", release);
    element.addEventListener("pointercancel", release);
    element.addEventListener("pointerleave", () => gestures.hover(null));
    element.addEventListener("wheel", (event) => {
        event.preventDefault();
        const lines = event.deltaMode === 1 ? 16 : 1;
        gestures.zoom([event.clientX, event.clientY], Math.exp(-Math.min(Math.max(event.deltaY * lines, -120), 120) * 0.0022));
    }, { passive: false });
}

function distance([x, y]: [number, number], [a, b]: [number, number]): number {
    return Math.hypot(x - a, y - b);
}
