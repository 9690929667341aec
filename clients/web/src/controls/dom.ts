/** Makes elements. Properties are set as such; `class`, `aria-*`, `data-*`, `role` and `for` as attributes. */
type Props = Record<string, unknown>;
type Child = Node | string | number | null | undefined | false;

export function el<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  props: Props = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(props)) {
    if (value === undefined || value === null) continue;
    if (name === "class" || name === "role" || name === "for" || name.startsWith("aria-") || name.startsWith("data-")) {
      made.setAttribute(name, String(value));
    } else {
      (made as unknown as Props)[name] = value;
    }
  }
  append(made, ...children);
  return made;
}

export function append(parent: Element, ...children: Child[]): void {
  for (const child of children) {
    if (child === null || child === undefined || child === false) continue;
    parent.append(child instanceof Node ? child : String(child));
  }
}

export function button(text: string, onclick: () => void, props: Props = {}): HTMLButtonElement {
  return el("button", { type: "button", onclick, ...props }, text);
}

/** A labelled control. `unit` follows it. */
export function field(label: string, control: HTMLElement, unit = ""): HTMLLabelElement {
  return el(
    "label",
    { class: "field" },
    el("span", {}, label),
    control,
    unit ? el("span", { class: "unit" }, unit) : null,
  );
}

/** Options of a drop-down list: value and text. */
export function choice(
  options: readonly (readonly [string, string])[],
  value: string,
  onchange: (value: string) => void,
): HTMLSelectElement {
  const made = el("select", { onchange: () => onchange(made.value) });
  for (const [key, text] of options) made.append(el("option", { value: key, selected: key === value }, text));
  return made;
}

/** Selects a thing by its number, for users without a pointer. count: of these things. */
export function picker(name: string, count: number, picked: (index: number) => void): HTMLElement {
  const box = el("input", {
    type: "number",
    min: "0",
    max: String(count - 1),
    step: "1",
    "aria-label": `${name} by number`,
  });
  const take = (): void => {
    if (box.value !== "" && box.validity.valid) picked(box.valueAsNumber);
  };
  box.onkeydown = (event) => {
    if (event.key === "Enter") take();
  };
  return el(
    "div",
    { class: "row" },
    el("label", {}, `${name} `, box),
    button("Select", take, { "aria-label": `Select the ${name.toLowerCase()}` }),
  );
}

/** A number of few digits, as people read it. */
export function number(value: number, digits = 3): string {
  if (!Number.isFinite(value)) return "not known";
  if (value === 0) return "0";
  const size = Math.abs(value);
  return size < 1e-3 || size >= 1e6 ? value.toExponential(digits - 1) : String(Number(value.toPrecision(digits)));
}
