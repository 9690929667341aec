import { button, el } from "./dom";

/** Asks in a dialog; false: the person changed their mind. content: fields that hold their answers themselves. */
export function ask(title: string, content: HTMLElement[], action: string): Promise<boolean> {
  return new Promise((resolve) => {
    const close = (answer: boolean): void => {
      dialog.close();
      dialog.remove();
      resolve(answer);
    };
    const form = el(
      "form",
      {
        onsubmit: (event: Event) => {
          event.preventDefault();
          close(true);
        },
      },
      el("h2", {}, title),
      ...content,
      el(
        "div",
        { class: "row" },
        el("button", { type: "submit" }, action),
        button("Cancel", () => close(false)),
      ),
    );
    const dialog = el("dialog", { class: "chooser", "aria-label": title }, form);
    dialog.oncancel = () => close(false);
    document.body.append(dialog);
    dialog.showModal();
  });
}
