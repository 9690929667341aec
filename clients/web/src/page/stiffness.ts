import { create } from "@bufbuild/protobuf";
import { PaintedQuantity, type PaintedStiffness, PaintedStiffnessSchema } from "../../gen/limber/v1/scene_pb";
import { choice, el } from "../controls/dom";

const QUANTITIES: readonly [string, string][] = [
  [String(PaintedQuantity.FACTOR), "factors of the stiffness"],
  [String(PaintedQuantity.YOUNGS_MODULUS), "Young's moduli [Pa]"],
];

/** A chooser of a file of numbers, one for each vertex of the surface, or of the mesh where there is no surface. */
export function stiffnessFile(): {
  file: HTMLInputElement;
  quantity: HTMLElement;
  read(): Promise<PaintedStiffness | undefined>;
} {
  const file = el("input", { type: "file", accept: ".txt,.csv,.ply,.json", "aria-label": "Stiffness by vertex" });
  let quantity = PaintedQuantity.FACTOR;
  const pick = choice(QUANTITIES, String(quantity), (value) => {
    quantity = Number(value);
  });
  const read = async (): Promise<PaintedStiffness | undefined> => {
    const chosen = file.files?.[0];
    return chosen && painted(chosen.name, new Uint8Array(await chosen.arrayBuffer()), quantity);
  };
  return { file, quantity: pick, read };
}

/** Painted stiffness of a scene; the server reads the file. */
export function painted(name: string, content: Uint8Array, quantity: PaintedQuantity): PaintedStiffness {
  return create(PaintedStiffnessSchema, { quantity, source: { case: "file", value: { name, content } } });
}
