/** What colours of axons mean: by type, birth, fascicle or heading, or one ink for all. */
import { CATEGORIES, css, cssGradient, cyclic, type Rgb, viridis } from "./colours.ts";
import { type Fascicles, fasciclesAtHalfHeight } from "./fascicles.ts";
import { Moment } from "./moment.ts";
import { written } from "./scales.ts";

/** The choices. */
export const AXON_COLOURS = ["ink", "type", "birth", "fascicle", "heading"] as const;
export type AxonColour = (typeof AXON_COLOURS)[number];

/** One line of a legend: swatches with words, or a bar with its ends. */
export type LegendEntry =
    | { swatch: string; text: string }
    | { bar: string; text: string; ends: [string, string] };

/** Colours of all axons and what they mean. */
export interface AxonColouring {
    /** [axons, 4] red, green, blue, 255. */
    table: Uint8Array<ArrayBuffer>;
    /** Whether pieces of shaft are coloured by their own direction instead. */
    byDirection: boolean;
    legend: LegendEntry[];
}

/** The ink of shafts. */
export function ink(dark: boolean): Rgb {
    return dark ? [0xe9, 0xe4, 0xee] : [0x1b, 0x13, 0x26];
}

const ALONE = (dark: boolean): Rgb => (dark ? [0x8d, 0x89, 0x93] : [0x8a, 0x85, 0x80]);

/** Colours axons; keeps what was found out of fascicles, as that depends on the last frame only. */
export class AxonColourist {
    private fascicles: Fascicles | null = null;

    constructor(private readonly moment: Moment, private readonly linkage: number) {}

    colour(choice: AxonColour, dark: boolean): AxonColouring {
        const { recording } = this.moment;
        switch (choice) {
            case "ink":
                return this.painted(() => ink(dark), []);
            case "type": {
                const colourOf = (population: number): Rgb => category(population, dark);
                const legend = recording.populations.map((text, i) => ({ swatch: css(colourOf(i)), text }));
                return this.painted((axon) => colourOf(recording.population[axon]), legend);
            }
            case "birth":
                return this.byBirth(dark);
            case "fascicle":
                return this.byFascicle(dark);
            case "heading": {
                const bar = cssGradient((share) => cyclic(share - 0.5, dark));
                const legend: LegendEntry = { bar, text: "direction: 0° to the right, 90° up", ends: ["−180°", "180°"] };
                return { ...this.painted((axon) => cyclic(this.moment.heading[axon] / 256, dark), [legend]), byDirection: true };
            }
        }
    }

    private byBirth(dark: boolean): AxonColouring {
        const { birth } = this.moment.recording;
        const [first, last] = birth.reduce(([a, b], time) => [Math.min(a, time), Math.max(b, time)], [Infinity, -Infinity]);
        const shade = (share: number): Rgb => (dark ? viridis(0.25 + 0.75 * share) : viridis(0.85 * share));
        const bar: LegendEntry = { bar: cssGradient(shade), text: "time of birth (h)", ends: [written(first), written(last)] };
        return this.painted((axon) => shade(last > first ? (birth[axon] - first) / (last - first) : 0), [bar]);
    }

    private byFascicle(dark: boolean): AxonColouring {
        const { recording } = this.moment;
        if (this.fascicles === null) {
            const end = new Moment(recording);
            end.moveTo(recording.frames[recording.frames.length - 1]);
            this.fascicles = fasciclesAtHalfHeight(end, this.linkage);
        }
        const { of, sizes } = this.fascicles;
        const named = Math.min(sizes.length, CATEGORIES.length);
        const legend: LegendEntry[] = sizes.slice(0, named).map((size, i) => ({ swatch: css(category(i, dark)), text: `${size} axons` }));
        legend.push({ swatch: css(ALONE(dark)), text: "smaller fascicles, single axons, none" });
        return this.painted((axon) => (of[axon] >= 0 && of[axon] < named ? category(of[axon], dark) : ALONE(dark)), legend);
    }

    private painted(colour: (axon: number) => Rgb, legend: LegendEntry[]): AxonColouring {
        const { axonCount } = this.moment.recording;
        const table = new Uint8Array(4 * axonCount);
        for (let axon = 0; axon < axonCount; axon++) table.set([...colour(axon), 255], 4 * axon);
        return { table, byDirection: false, legend };
    }
}

/** What a choice of colour means, in words. */
export function colourSentence(choice: AxonColour, linkage: number): string {
    const end = "at half the tissue's height at the end of the run";
    return choice === "fascicle" ? `Fascicles: axons no further than ${written(linkage)} µm from the next one ${end}, the largest first.` : "";
}

function category(index: number, dark: boolean): Rgb {
    const colour = CATEGORIES[index % CATEGORIES.length];
    return dark ? (colour.map((channel) => Math.round(channel + 0.25 * (255 - channel))) as Rgb) : colour;
}
