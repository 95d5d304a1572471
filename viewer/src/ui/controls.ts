/** What the reader chooses: colours, cue, map, scale, layers, types. */
import { LAYERS, type LayerName, type Look } from "../gl/pane.ts";
import type { Shown } from "../gl/tissue.ts";
import type { Cue, Recording } from "../data/recording.ts";
import { AXON_COLOURS, type AxonColour } from "../numbers/axon_colours.ts";
import { MAPS, type MapName } from "../numbers/colours.ts";
import { concentrationRange } from "../numbers/scales.ts";
import { choice, h, toggle } from "./dom.ts";

const COLOUR_WORDS: Record<AxonColour, string> = {
    ink: "one ink, cones by status", type: "type", birth: "time of birth", fascicle: "fascicle", heading: "heading",
};
const MAP_WORDS: Record<MapName, string> = { tint: "tints, as in the figures", viridis: "viridis", cividis: "cividis" };
const LAYER_WORDS: Record<LayerName, string> = {
    tissue: "tissue and cue", shafts: "shafts", cones: "growth cones", outline: "outline", start: "outline at the start", targets: "targets",
};

/** The look that a page begins with: all cues in tints, axons by type where there are several. */
export function firstLook(recordings: Recording[], dark: boolean): Look {
    const several = (recordings[0]?.populations.length ?? 0) > 1;
    return {
        dark,
        colour: several ? "type" : "ink",
        cues: { ...shownCues(recordings, "all"), map: "tint", logarithmic: true },
        layers: { tissue: true, shafts: true, cones: true, outline: true, start: true, targets: true },
        hidden: new Set(),
    };
}

/** The controls; they change the look and call back. */
export function controls(look: Look, recordings: Recording[], changed: () => void): HTMLElement {
    const [recording] = recordings;
    const cues: [string, string][] = [["all", "all"], ["none", "none"]];
    const known = cuesOf(recordings);
    if (known.length > 1) known.forEach(({ name, effect }, index) => cues.push([String(index), effect ? `${name} (${effect}s)` : name]));
    const populations = recording.populations.length < 2 ? [] : recording.populations.map((name, index) =>
        toggle(name, `type-${index}`, true, (shown) => { look.hidden[shown ? "delete" : "add"](index); changed(); }));
    return h("div", { class: "controls" },
        choice("Colour axons by", "colour", AXON_COLOURS.map((key) => [key, COLOUR_WORDS[key]]), look.colour, (value) => { look.colour = value as AxonColour; changed(); }),
        known.length === 0 ? null : choice("Cue", "cue", cues, "all", (value) => { Object.assign(look.cues, shownCues(recordings, value)); changed(); }),
        known.length === 0 ? null : choice("Colour map", "map", MAPS.map((key) => [key, MAP_WORDS[key]]), look.cues.map, (value) => { look.cues.map = value as MapName; changed(); }),
        known.length === 0 ? null : choice("Scale", "scale", [["log", "logarithmic"], ["linear", "linear"]], "log", (value) => { look.cues.logarithmic = value === "log"; changed(); }),
        h("fieldset", {}, h("legend", {}, "Layers"), ...LAYERS.map((layer) => toggle(LAYER_WORDS[layer], `layer-${layer}`, look.layers[layer], (shown) => { look.layers[layer] = shown; changed(); }))),
        populations.length > 0 ? h("fieldset", {}, h("legend", {}, "Types"), ...populations) : null,
    );
}

/** The cues of all recordings, each name once: an arm of an ablation may lack some. */
function cuesOf(recordings: Recording[]): Cue[] {
    return [...new Map(recordings.flatMap(({ cues }) => cues).map((cue) => [cue.name, cue])).values()];
}

/** The cues to show for a choice: `all`, `none` or the index of one. */
function shownCues(recordings: Recording[], value: string): { attract: Shown | null; repel: Shown | null } {
    const known = cuesOf(recordings);
    const chosen = value === "none" ? [] : value === "all" ? known : [known[Number(value)]];
    const shown = (some: Cue[]): Shown | null => {
        if (some.length === 0) return null;
        const cues = some.map(({ name }) => name);
        const sum = (recording: Recording): number => recording.cues.reduce((total, cue) => total + (cues.includes(cue.name) ? cue.maximum : 0), 0);
        return { cues, range: concentrationRange(0, Math.max(...recordings.map(sum))) };
    };
    return { attract: shown(chosen.filter(({ effect }) => effect !== "repel")), repel: shown(chosen.filter(({ effect }) => effect === "repel")) };
}
