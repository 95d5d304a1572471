/** One recording on the canvas: its layers, and how they follow time, colours and the camera. */
import * as three from "three";
import type { Recording } from "../data/recording.ts";
import { type AxonColour, AxonColourist, ink, type LegendEntry } from "../numbers/axon_colours.ts";
import { Finder } from "../numbers/axon.ts";
import type { Camera, Size } from "../numbers/camera.ts";
import { cyclic, type Rgb } from "../numbers/colours.ts";
import { Moment } from "../numbers/moment.ts";
import { outlineOf } from "../numbers/outline.ts";
import { coneSize, ConeLayer } from "./cones.ts";
import { Ribbons } from "./ribbons.ts";
import { ShaftLayer } from "./shafts.ts";
import { byteTexture, floatTexture, type ViewUniforms } from "./textures.ts";
import { type CueChoice, TissueLayer } from "./tissue.ts";
import { type Paint, PaintedLayer } from "../soft/painter.ts";

/** The layers that can be switched. */
export const LAYERS = ["tissue", "shafts", "cones", "outline", "start", "targets"] as const;
export type LayerName = (typeof LAYERS)[number];

/** How panes look. */
export interface Look {
    dark: boolean;
    colour: AxonColour;
    cues: CueChoice;
    layers: Record<LayerName, boolean>;
    /** Populations that are hidden. */
    hidden: Set<number>;
}

/** The pane of one recording. */
export class Pane {
    readonly moment: Moment;
    readonly finder: Finder;
    /** What the colours of axons mean. */
    legend: LegendEntry[] = [];
    private readonly view: ViewUniforms = { view: { value: new three.Vector4(0, 0, 1, 1) }, extent: { value: new three.Vector2(1, 1) } };
    private readonly scene = new three.Scene();
    private readonly tips: three.DataTexture;
    private readonly colours: three.DataTexture;
    private readonly hues = byteTexture(1);
    private readonly tissue: TissueLayer;
    private readonly shafts: ShaftLayer;
    private readonly cones: ConeLayer;
    private readonly ribbons: Record<"start" | "outline" | "halo" | "chosen" | "targetHalo" | "target", Ribbons>;
    private readonly border: number[][];
    private readonly colourist: AxonColourist;
    private look: Look | null = null;
    private written = { time: Number.NaN, level: -1 };
    private readonly painted: PaintedLayer | null;
    private paint: Paint | null = null;
    private paintedView = "";

    /** A pane; `soft` where the processor is to paint what is many. */
    constructor(readonly recording: Recording, linkage: number, soft: boolean) {
        this.moment = new Moment(recording);
        this.finder = new Finder(this.moment);
        this.colourist = new AxonColourist(this.moment, linkage);
        this.tips = floatTexture(recording.axonCount);
        this.colours = byteTexture(recording.axonCount);
        this.tissue = new TissueLayer(recording, this.view);
        const shared = { vertices: this.tissue.vertices, tips: this.tips, colours: this.colours, hues: this.hues, looks: byteTexture(256) };
        this.shafts = new ShaftLayer(recording, this.view, shared);
        this.cones = new ConeLayer(recording.axonCount, recording.statusWords, this.view, shared);
        const ribbon = (order: number): Ribbons => new Ribbons(this.view, order);
        this.ribbons = { start: ribbon(1), outline: ribbon(1), targetHalo: ribbon(3), target: ribbon(3), halo: ribbon(5), chosen: ribbon(6) };
        this.border = outlineOf(recording.cells);
        this.ribbons.start.draw(this.border.map((line) => this.meshLine(line)));
        this.hues.wrapS = three.RepeatWrapping;
        this.hues.magFilter = this.hues.minFilter = three.LinearFilter;
        this.painted = soft ? new PaintedLayer(recording) : null;
        if (this.painted) this.scene.add(this.painted.mesh);
        this.scene.add(this.tissue.mesh, this.shafts.mesh, this.cones.points, ...Object.values(this.ribbons).map(({ mesh }) => mesh));
    }

    /** Takes colours and layers. */
    setLook(look: Look, density: number, background: Rgb): void {
        this.look = look;
        const { dark, layers } = look;
        const count = this.recording.axonCount;
        const byHue = look.colour === "heading";
        const opacity = (look.colour === "ink" ? 0.42 : 0.6) * (count > 3000 ? 0.6 : 1);
        const rim: Rgb = dark ? [0x14, 0x13, 0x17] : [255, 255, 255];
        const outline: Rgb = dark ? [0xa8, 0xa3, 0x9c] : [0x6b, 0x66, 0x60];
        this.tissue.choose(look.cues, dark);
        this.shafts.style(count > 3000 ? 1 : 1.3, opacity, byHue);
        this.cones.style(density, look.colour === "ink", rim);
        this.ribbons.outline.style(1.3, outline, 1);
        this.ribbons.start.style(1.2, outline, 0.75, [2, 3]);
        this.ribbons.targetHalo.style(3.6, rim, 0.85);
        this.ribbons.target.style(1.5, ink(dark), 1, [5, 3.5]);
        this.ribbons.halo.style(6, dark ? [0, 0, 0] : [255, 255, 255], 0.9);
        this.ribbons.chosen.style(2.6, dark ? [0xf0, 0xe4, 0x42] : [0xc2, 0x18, 0x5b], 1);
        const soft = this.painted !== null;
        this.tissue.mesh.visible = layers.tissue && !soft;
        this.shafts.mesh.visible = layers.shafts && !soft;
        this.cones.points.visible = layers.cones && !soft;
        this.ribbons.outline.mesh.visible = layers.outline;
        this.ribbons.start.mesh.visible = layers.start && this.recording.moves;
        this.ribbons.target.mesh.visible = this.ribbons.targetHalo.mesh.visible = layers.targets && !soft;
        this.fillHues(dark);
        this.recolour();
        this.written.time = Number.NaN;
        const { tissue, shafts, cones } = layers;
        const hues = byHue ? (this.hues.image.data as Uint8Array) : null;
        this.paint = { background, dark, cues: look.cues, tissue, shafts, cones, opacity, colours: this.colours.image.data as Uint8Array, hues, byStatus: look.colour === "ink", rim, ink: ink(dark) };
        this.painted?.prepare(this.paint);
    }

    /** Vertices of shafts that the last drawing took. */
    get vertices(): number {
        return this.painted?.vertices ?? this.shafts.vertices;
    }

    /** Whether an axon's population is shown. */
    isShown = (axon: number): boolean => !this.look?.hidden.has(this.recording.population[axon]);

    /** Draws at a time into the renderer's viewport of some CSS pixels. */
    draw(renderer: three.WebGLRenderer, time: number, camera: Camera, size: Size, level: number, chosen: number | null, eye: three.Camera): void {
        this.moment.moveTo(time);
        this.view.view.value.set(camera.x, camera.y, (camera.scale * size.width) / 2, (camera.scale * size.height) / 2);
        this.view.extent.value.set(size.width, size.height);
        if (this.written.time !== time || this.written.level !== level) {
            this.tissue.update(this.moment);
            this.fillTips();
            if (this.look?.colour === "heading") this.recolour();
            if (!this.painted) this.shafts.update(renderer, this.moment, level, eye);
            this.ribbons.outline.draw(this.border.map((line) => this.meshLine(line)));
            const targets = this.targetLines();
            this.ribbons.target.draw(targets);
            this.ribbons.targetHalo.draw(targets);
            this.written = { time, level };
            this.paintedView = "";
        }
        this.cones.resize(coneSize(this.recording, camera));
        this.repaint(camera, size, level);
        const shaft = chosen === null ? [] : [this.moment.shaft(chosen)];
        this.ribbons.halo.draw(shaft);
        this.ribbons.chosen.draw(shaft);
        renderer.render(this.scene, eye);
    }

    /** The lines of the targets at the present moment. */
    targetLines(): number[][] {
        const { targets, cells } = this.recording;
        return targets.map(({ points, closed, cells: riding, weights }) => {
            const line = points.flatMap((point, i) => {
                const pair = weights?.[i];
                if (!riding || !Array.isArray(pair)) return point;
                return this.moment.materialPoint(cells.subarray(3 * riding[i], 3 * riding[i] + 3), pair[0] / 65535, pair[1] / 65535);
            });
            return closed ? [...line, line[0], line[1]] : line;
        });
    }

    /** Paints anew where time, view or look have changed. */
    private repaint(camera: Camera, size: Size, level: number): void {
        const view = [camera.x, camera.y, camera.scale, size.width, size.height, level].join(" ");
        if (!this.painted || !this.paint || view === this.paintedView) return;
        this.paintedView = view;
        this.painted.paint(this.paint, this.moment, this.tissue.vertices.image.data as Float32Array, this.look?.layers.targets ? this.targetLines() : [], { camera, size }, level);
    }

    private meshLine(line: number[]): number[] {
        return line.flatMap((vertex) => [this.moment.mesh[2 * vertex], this.moment.mesh[2 * vertex + 1]]);
    }

    private fillTips(): void {
        const data = this.tips.image.data as Float32Array;
        const { tips, visible, status } = this.moment;
        for (let axon = 0; axon < visible.length; axon++) {
            data[4 * axon] = tips[2 * axon];
            data[4 * axon + 1] = tips[2 * axon + 1];
            data[4 * axon + 2] = visible[axon];
            data[4 * axon + 3] = status[axon];
        }
        this.tips.needsUpdate = true;
    }

    private recolour(): void {
        if (!this.look) return;
        const { table, legend } = this.colourist.colour(this.look.colour, this.look.dark);
        for (let axon = 0; axon < this.recording.axonCount; axon++) if (!this.isShown(axon)) table[4 * axon + 3] = 0;
        (this.colours.image.data as Uint8Array).set(table);
        this.colours.needsUpdate = true;
        this.legend = legend;
    }

    private fillHues(dark: boolean): void {
        const data = this.hues.image.data as Uint8Array;
        for (let i = 0; i < data.length / 4; i++) data.set([...cyclic(i / (data.length / 4), dark), 255], 4 * i);
        this.hues.needsUpdate = true;
    }
}
