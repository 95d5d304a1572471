/** The card with the numbers of one axon. */
import type { AxonNumbers } from "../numbers/axon.ts";
import { written } from "../numbers/scales.ts";
import { h } from "./dom.ts";

/** The card of an axon that is hovered over or followed. */
export class Card {
    readonly element = h("section", { class: "card", "aria-label": "Axon", "aria-live": "polite", hidden: true });

    constructor(private readonly release: () => void) {}

    /** Shows numbers; none hides the card. */
    show(numbers: AxonNumbers | null, followed: boolean): void {
        this.element.hidden = numbers === null;
        if (numbers === null) return;
        const rows: [string, string][] = [
            ["type", numbers.population],
            ["status", numbers.status],
            ["born", `${written(numbers.birth)} h`],
            ["length", `${written(numbers.length)} µm`],
            ["straightness", written(numbers.straightness)],
            ["heading", `${written(Math.round(numbers.heading))}°`],
            ["cone at", `${written(numbers.tip[0])}, ${written(numbers.tip[1])} µm`],
        ];
        if (numbers.parent !== null) rows.push(["branch of", `axon ${numbers.parent}`]);
        if (numbers.arrival !== null) rows.push(["arrives", `by ${written(numbers.arrival)} h`]);
        const close = followed ? h("button", { type: "button", class: "close", "aria-label": "Let go of this axon", click: this.release }, "×") : null;
        this.element.replaceChildren(
            h("h3", {}, `Axon ${numbers.axon}`, followed ? h("span", { class: "tag" }, "followed") : null, close),
            h("dl", {}, ...rows.flatMap(([name, value]) => [h("dt", {}, name), h("dd", {}, value)])),
        );
    }
}
