/** Making elements. */

type Child = Node | string | null;
type Properties = Record<string, string | number | boolean | EventListener | ((event: never) => void) | null>;

/** An element with attributes (functions become listeners, null and false are left out) and children. */
export function h<K extends keyof HTMLElementTagNameMap>(tag: K, properties: Properties = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
    return dressed(document.createElement(tag), properties, children);
}

/** The same for SVG. */
export function svg<K extends keyof SVGElementTagNameMap>(tag: K, properties: Properties = {}, ...children: Child[]): SVGElementTagNameMap[K] {
    return dressed(document.createElementNS("http://www.w3.org/2000/svg", tag), properties, children);
}

function dressed<T extends Element>(element: T, properties: Properties, children: Child[]): T {
    for (const [name, value] of Object.entries(properties)) {
        if (typeof value === "function") element.addEventListener(name, value as EventListener);
        else if (value === true) element.setAttribute(name, "");
        else if (value !== null && value !== false) element.setAttribute(name, String(value));
    }
    element.append(...children.filter((child): child is Node | string => child !== null));
    return element;
}

/** A labelled choice out of several. */
export function choice(label: string, id: string, options: [value: string, text: string][], value: string, changed: (value: string) => void): HTMLElement {
    const select = h("select", { id, change: () => changed(select.value) }, ...options.map(([key, text]) => h("option", { value: key, selected: key === value }, text)));
    return h("div", { class: "field" }, h("label", { for: id }, label), select);
}

/** A labelled switch. */
export function toggle(label: string, id: string, value: boolean, changed: (value: boolean) => void): HTMLElement {
    const input = h("input", { type: "checkbox", id, checked: value, change: () => changed(input.checked) });
    return h("label", { class: "toggle" }, input, label);
}
