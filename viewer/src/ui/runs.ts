/** The page of one run or of several side by side: stage, controls, time, numbers, measures. */
import { measuresOf } from "../data/measures.ts";
import type { Recording } from "../data/recording.ts";
import type { Report } from "../data/report.ts";
import { type Chosen, Stage } from "../gl/stage.ts";
import { axonNumbers } from "../numbers/axon.ts";
import { colourSentence } from "../numbers/axon_colours.ts";
import { fitting, pixelOf, pointAt, zoomed } from "../numbers/camera.ts";
import { roundDown, written } from "../numbers/scales.ts";
import { Card } from "./card.ts";
import { controls, firstLook } from "./controls.ts";
import { h } from "./dom.ts";
import { legend } from "./legend.ts";
import { MeasureFigures } from "./measures.ts";
import { listen } from "./pointer.ts";
import type { Theme } from "./theme.ts";
import { Transport } from "./transport.ts";

/** A run and what it is called beside others. */
export interface Run {
    label: string;
    recording: Recording;
}

/** Linkage distance where the report names none, µm. */
const LINKAGE = 10;
/** Pixels around a pointer within which an axon is found. */
const REACH = 12;
/** Milliseconds between two updates of texts and figures while time runs: drawing them anew costs more than the scene. */
const TELLING = 150;

/** Stage and controls of runs. */
export class Runs {
    readonly element: HTMLElement;
    private readonly stage: Stage;
    private readonly transport: Transport;
    private readonly figures: MeasureFigures;
    private readonly card: Card;
    private readonly look;
    private readonly linkage: number;
    private readonly legendPlace = h("div", {});
    private readonly scaleBar = h("div", { class: "scale-bar" }, h("span", {}), h("i", {}));
    private readonly surface: HTMLElement;
    private followed: Chosen | null = null;
    private hovered: Chosen | null = null;
    private pointer: [number, number] | null = null;
    /** When the figures of the measures were last brought up to date, and whether they are with the present frame. */
    private told = 0;
    private telling = true;
    /** µm a pixel at which everything is seen. */
    private fitted = 1;

    constructor(runs: Run[], report: Report, private readonly theme: Theme) {
        const recordings = runs.map(({ recording }) => recording);
        this.linkage = report.linkage_distance || LINKAGE;
        this.look = firstLook(recordings, theme.dark);
        const canvas = h("canvas", { id: "canvas", "aria-hidden": "true" });
        const places = runs.map(({ label, recording }) => {
            const element = h("div", { class: "pane" }, label ? h("span", { class: "pane-label" }, label) : null);
            return { recording, element };
        });
        this.stage = new Stage(canvas, places, this.linkage);
        this.transport = new Transport(longest(recordings).frames, this.stage.soft ? TELLING : 0, (time) => this.moveTo(time));
        this.figures = new MeasureFigures(runs.map(({ label, recording }) => ({ label, columns: measuresOf(recording) })), (time) => this.transport.jump(time));
        this.card = new Card(() => this.follow(null));
        this.surface = h("div", {
            class: runs.length > 1 ? "surface several" : "surface", id: "surface", tabindex: 0, role: "application",
            "aria-label": "The scene: drag to move, plus and minus to zoom, zero to see all, comma and full stop to go through the axons",
        }, canvas, ...places.map(({ element }) => element), this.scaleBar, this.zoomButtons(), this.card.element);
        const side = h("aside", { class: "side", "aria-label": "View" }, this.legendPlace, controls(this.look, recordings, () => this.restyle()), keys());
        this.element = h("div", { class: "runs" },
            h("div", { class: "main" }, this.surface, this.transport.element), side,
            h("section", { class: "measures", "aria-label": "Measures over time" }, h("h2", {}, "Measures over time"), this.figures.element));
        this.stage.afterDraw = () => this.showPlaces();
        listen(this.surface, {
            pan: (dx, dy) => this.pan(dx, dy),
            zoom: (at, factor) => this.zoom(at, factor),
            hover: (at) => this.hover(at),
            choose: (at) => this.follow(this.find(at)),
        });
        document.addEventListener("keydown", (event) => this.key(event) && event.preventDefault());
    }

    /** Begins, once the element is in the page. */
    start(): void {
        this.fit();
        this.restyle();
        this.transport.goTo(this.transport.time);
        let size = this.stage.sizeOf(0);
        new ResizeObserver(() => {
            const now = this.stage.sizeOf(0);
            if (Math.abs(now.width - size.width) > 1 || Math.abs(now.height - size.height) > 1) this.fit();
            size = now;
            this.stage.change();
        }).observe(this.surface);
    }

    /** Takes colours, layers and theme. */
    restyle(): void {
        this.look.dark = this.theme.dark;
        this.stage.setLook(this.look, this.theme.colour("--stage"));
        const [{ pane }] = this.stage.places;
        const seen = new Set(this.stage.places.flatMap(({ pane: { recording } }) => [...new Set(recording.tipStatus)].map((status) => recording.statusWords[status])));
        const statuses = pane.recording.statusWords.filter((word) => seen.has(word) && word !== "unborn" && word !== "withdrawn");
        this.legendPlace.replaceChildren(legend(this.look, pane.legend, statuses, colourSentence(this.look.colour, this.linkage)));
    }

    private moveTo(time: number): void {
        this.stage.time = time;
        const now = performance.now();
        this.telling = !this.transport.playing || now - this.told > TELLING;
        if (this.telling) {
            this.figures.show(time);
            this.told = now;
        }
        this.stage.change();
    }

    private fit(): void {
        const boxes = this.stage.places.map(({ pane }) => pane.recording.box);
        const [x0, y0, x1, y1] = [0, 1, 2, 3].map((side) => Math[side < 2 ? "min" : "max"](...boxes.map((box) => box[side])));
        this.stage.camera = fitting([x0, y0, x1, y1], this.stage.sizeOf(0));
        this.fitted = this.stage.camera.scale;
        this.stage.change();
    }

    private pan(dx: number, dy: number): void {
        const { camera } = this.stage;
        this.stage.camera = { ...camera, x: camera.x - dx * camera.scale, y: camera.y + dy * camera.scale };
        this.stage.change();
    }

    private zoom(at: [number, number] | null, factor: number): void {
        const size = this.stage.sizeOf(0);
        const index = at === null ? null : this.placeUnder(at);
        const corner = index === null ? null : this.stage.places[index].element.getBoundingClientRect();
        const pixel: [number, number] = at && corner ? [at[0] - corner.left, at[1] - corner.top] : [size.width / 2, size.height / 2];
        this.stage.camera = zoomed(this.stage.camera, size, pixel, factor, this.fitted);
        this.stage.change();
    }

    private hover(at: [number, number] | null): void {
        this.pointer = at;
        this.stage.change();
    }

    /** Follows an axon, or none. */
    private follow(chosen: Chosen | null): void {
        this.followed = this.stage.chosen = chosen;
        this.hovered = null;
        this.stage.change();
    }

    private placeUnder([x, y]: [number, number]): number | null {
        const index = this.stage.places.findIndex(({ element }) => {
            const { left, right, top, bottom } = element.getBoundingClientRect();
            return x >= left && x <= right && y >= top && y <= bottom;
        });
        return index < 0 ? null : index;
    }

    private find(at: [number, number]): Chosen | null {
        const place = this.placeUnder(at);
        if (place === null) return null;
        const { pane, element } = this.stage.places[place];
        const corner = element.getBoundingClientRect();
        const point = pointAt(this.stage.camera, this.stage.sizeOf(place), [at[0] - corner.left, at[1] - corner.top]);
        const axon = pane.finder.near(point, REACH * this.stage.camera.scale, pane.isShown);
        return axon === null ? null : { place, axon };
    }

    /** After a drawing: what is under the pointer, the card, the scale bar, and the camera behind a followed cone. */
    private showPlaces(): void {
        this.showScale();
        const found = this.pointer === null ? null : this.transport.playing ? this.hovered : this.find(this.pointer);
        if (!isSame(found, this.hovered) && found !== this.hovered) {
            this.hovered = found;
            this.stage.chosen = found ?? this.followed;
            this.stage.change();
        }
        const told = this.hovered ?? this.followed;
        if (this.telling || told === null || !this.transport.playing) this.card.show(told ? axonNumbers(this.stage.places[told.place].pane.moment, told.axon) : null, isSame(told, this.followed));
        this.surface.classList.toggle("found", this.hovered !== null);
        if (this.followed && this.transport.playing) this.keepInView(this.followed);
    }

    /** Moves the camera with a cone. */
    private keepInView({ place, axon }: Chosen): void {
        const { moment } = this.stage.places[place].pane;
        if (!moment.visible[axon]) return;
        const { camera } = this.stage;
        const tip: [number, number] = [moment.tips[2 * axon], moment.tips[2 * axon + 1]];
        const size = this.stage.sizeOf(place);
        const [px, py] = pixelOf(camera, size, tip);
        if (this.fitted / camera.scale < 1.2 && px > 0 && py > 0 && px < size.width && py < size.height) return;
        this.stage.camera = { ...camera, x: camera.x + 0.2 * (tip[0] - camera.x), y: camera.y + 0.2 * (tip[1] - camera.y) };
    }

    private showScale(): void {
        const { scale } = this.stage.camera;
        const length = roundDown(Math.min(120, this.stage.sizeOf(0).width * 0.3) * scale);
        const [text, line] = [this.scaleBar.firstElementChild as HTMLElement, this.scaleBar.lastElementChild as HTMLElement];
        const words = `${written(length)} µm`;
        if (text.textContent !== words) text.textContent = words;
        const width = `${length / scale}px`;
        if (line.style.width !== width) line.style.width = width;
    }

    private zoomButtons(): HTMLElement {
        const button = (text: string, label: string, act: () => void): HTMLElement =>
            h("button", { type: "button", "aria-label": label, title: label, click: act, pointerdown: (event: Event) => event.stopPropagation() }, text);
        return h("div", { class: "zoom" }, button("+", "Zoom in (+)", () => this.zoom(null, 1.5)), button("−", "Zoom out (−)", () => this.zoom(null, 1 / 1.5)), button("⤢", "See all (0)", () => this.fit()));
    }

    private key(event: KeyboardEvent): boolean {
        const target = event.target instanceof HTMLElement ? event.target : document.body;
        if (target.closest("input, select, textarea") || event.ctrlKey || event.metaKey || event.altKey) return false;
        const moves: Record<string, [number, number]> = { ArrowLeft: [60, 0], ArrowRight: [-60, 0], ArrowUp: [0, 60], ArrowDown: [0, -60] };
        if (event.key in moves && (event.shiftKey || (target === this.surface && moves[event.key][0] === 0))) this.pan(...moves[event.key]);
        else if (event.key === " " && !target.closest("button, summary, a, pre")) this.transport.toggle();
        else if (event.key === "+" || event.key === "=") this.zoom(null, 1.25);
        else if (event.key === "-") this.zoom(null, 0.8);
        else if (event.key === "0") this.fit();
        else if (event.key === "." || event.key === ",") this.next(event.key === "." ? 1 : -1);
        else if (event.key === "Escape") this.follow(null);
        else return !target.closest("pre") && this.transport.key(event);
        return true;
    }

    /** Follows the next axon that is there and shown. */
    private next(by: number): void {
        const place = this.followed?.place ?? 0;
        const { pane } = this.stage.places[place];
        const count = pane.recording.axonCount;
        pane.moment.moveTo(this.stage.time);
        let axon = this.followed?.axon ?? (by > 0 ? -1 : count);
        for (let tried = 0; tried < count; tried++) {
            axon = (axon + by + count) % count;
            if (pane.moment.visible[axon] && pane.isShown(axon)) return this.follow({ place, axon });
        }
    }
}

function isSame(one: Chosen | null, other: Chosen | null): boolean {
    return one !== null && other !== null && one.place === other.place && one.axon === other.axon;
}

function longest(recordings: Recording[]): Recording {
    const end = (recording: Recording): number => recording.frames[recording.frames.length - 1];
    return recordings.reduce((best, recording) => (end(recording) > end(best) ? recording : best));
}

function keys(): HTMLElement {
    const rows: [string, string][] = [
        ["space", "play, pause"], ["← →", "a frame back, on"], ["Home End", "start, end"], ["+ − 0", "zoom in, out, see all"],
        ["shift + arrows", "move the view"], [", .", "previous, next axon"], ["Esc", "let go of the axon"],
    ];
    return h("details", { class: "keys" }, h("summary", {}, "Keys"), h("dl", {}, ...rows.flatMap(([key, text]) => [h("dt", {}, h("kbd", {}, key)), h("dd", {}, text)])));
}
