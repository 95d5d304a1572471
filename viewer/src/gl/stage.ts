/** The canvas that all panes share: one renderer, one camera, one time; it draws when something has changed. */
import * as three from "three";
import type { Camera, Size } from "../numbers/camera.ts";
import type { Rgb } from "../numbers/colours.ts";
import { LEVELS } from "./shafts.ts";
import type { Recording } from "../data/recording.ts";
import { PAINTED_LEVELS } from "../soft/painter.ts";
import { Pace } from "../numbers/pace.ts";
import { type Look, Pane } from "./pane.ts";

/** A pane and the element whose place it fills. */
export interface Place {
    pane: Pane;
    element: HTMLElement;
}

/** Milliseconds after the last movement at which all is drawn. */
const STILL = 350;

/** The axon that stands out: index of its place, and its own. */
export interface Chosen {
    place: number;
    axon: number;
}

/** What is drawn, and the drawing of it. */
export class Stage {
    camera: Camera = { x: 0, y: 0, scale: 1 };
    time = 0;
    chosen: Chosen | null = null;
    /** Called after each drawing. */
    afterDraw: () => void = () => {};
    private readonly renderer: three.WebGLRenderer;
    private readonly eye = new three.Camera();
    private requested = false;
    private readonly pace: Pace;
    /** What the last drawing showed; level 0 is everything. */
    private shown: { time: number; camera: Camera; level: number } | null = null;
    private rest: ReturnType<typeof setTimeout> | undefined;
    private background: string = "#ffffff";

    readonly places: Place[];
    /** Whether WebGL runs on the processor, which then paints by itself what is many. */
    readonly soft: boolean;

    constructor(private readonly canvas: HTMLCanvasElement, panes: { recording: Recording; element: HTMLElement }[], linkage: number) {
        this.renderer = new three.WebGLRenderer({ canvas, antialias: false, alpha: false, depth: false, preserveDrawingBuffer: true });
        this.renderer.outputColorSpace = three.LinearSRGBColorSpace;
        this.renderer.autoClear = false;
        this.renderer.setScissorTest(true);
        this.soft = isSoftware(this.renderer.getContext() as WebGL2RenderingContext);
        this.pace = this.soft ? new Pace(1, PAINTED_LEVELS - 1) : new Pace(0, LEVELS - 1);
        canvas.dataset["drawing"] = this.soft ? "processor" : "graphics";
        this.places = panes.map(({ recording, element }) => ({ element, pane: new Pane(recording, linkage, this.soft) }));
        canvas.addEventListener("webglcontextrestored", () => this.change());
    }

    /** Device pixels a CSS pixel, at most two. */
    get density(): number {
        return this.soft ? 1 : Math.min(window.devicePixelRatio || 1, 2);
    }

    /** Takes colours and layers. */
    setLook(look: Look, background: string): void {
        this.background = background;
        const colour = new three.Color().setStyle(background, three.LinearSRGBColorSpace);
        const rgb: Rgb = [colour.r, colour.g, colour.b].map((channel) => Math.round(255 * channel)) as Rgb;
        for (const { pane } of this.places) pane.setLook(look, this.density, rgb);
        this.change();
    }

    /** Extent of a place in CSS pixels. */
    sizeOf(place: number): Size {
        const { width, height } = this.places[place].element.getBoundingClientRect();
        return { width, height };
    }

    /** Asks for a drawing: with less detail, if need be, where time or view have moved since the last one; all of it soon after. */
    change(): void {
        if (this.requested) return;
        this.requested = true;
        requestAnimationFrame((now) => {
            this.requested = false;
            const level = this.shown === null ? 0 : this.isMoved(this.shown) ? this.pace.levelAt(now) : this.shown.level;
            this.draw(level);
            clearTimeout(this.rest);
            this.rest = setTimeout(() => this.settle(), STILL);
        });
    }

    private settle(): void {
        this.pace.rest();
        if (this.shown?.level !== 0) this.draw(0);
    }

    private isMoved({ time, camera: { x, y, scale } }: { time: number; camera: Camera }): boolean {
        const { camera } = this;
        return time !== this.time || x !== camera.x || y !== camera.y || scale !== camera.scale;
    }

    private draw(level: number): void {
        const { renderer } = this;
        const area = this.canvas.getBoundingClientRect();
        if (area.width < 1 || area.height < 1) return;
        if (renderer.getPixelRatio() !== this.density) renderer.setPixelRatio(this.density);
        const size = renderer.getSize(new three.Vector2());
        if (size.x !== area.width || size.y !== area.height) renderer.setSize(area.width, area.height, false);
        renderer.setClearColor(new three.Color().setStyle(this.background, three.LinearSRGBColorSpace), 1);
        this.places.forEach(({ pane, element }, index) => {
            const place = element.getBoundingClientRect();
            const bottom = area.bottom - place.bottom;
            const chosen = this.chosen?.place === index ? this.chosen.axon : null;
            renderer.setViewport(place.left - area.left, bottom, place.width, place.height);
            renderer.setScissor(place.left - area.left, bottom, place.width, place.height);
            renderer.clear();
            pane.draw(renderer, this.time, this.camera, place, level, chosen, this.eye);
        });
        this.shown = { time: this.time, camera: this.camera, level };
        this.canvas.dataset["vertices"] = String(this.places.reduce((sum, { pane }) => sum + pane.vertices, 0));
        this.afterDraw();
    }
}

/** Whether WebGL is a program on the processor; `#drawing=graphics` or `#drawing=processor` in the address decides instead. */
function isSoftware(gl: WebGL2RenderingContext): boolean {
    const wished = /drawing=(graphics|processor)/.exec(window.location.hash)?.[1];
    if (wished) return wished === "processor";
    const unmasked = gl.getExtension("WEBGL_debug_renderer_info")?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER;
    return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(String(gl.getParameter(unmasked)));
}
