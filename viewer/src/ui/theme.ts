/** Dark and light: the system's choice, until the reader makes another. */

const query = window.matchMedia("(prefers-color-scheme: dark)");

/** The present theme; calls back when it changes. */
export class Theme {
    private chosen: boolean | null = null;

    constructor(private readonly changed: () => void) {
        query.addEventListener("change", () => this.apply());
        this.apply();
    }

    /** Whether the page is dark. */
    get dark(): boolean {
        return this.chosen ?? query.matches;
    }

    /** Goes to the other one. */
    switch = (): void => {
        this.chosen = !this.dark;
        this.apply();
    };

    /** A colour of the style sheet. */
    colour(name: string): string {
        return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    }

    private apply(): void {
        document.documentElement.dataset["theme"] = this.dark ? "dark" : "light";
        this.changed();
    }
}
