// SPDX-License-Identifier: Apache-2.0
// The contact graph round the active pair: the basic contacts that hold the part or are near, their neighbours, and the
// arcs between them. A click names a basic contact and marks its two features in the other panes.
import type { Answer } from "./messages";
import { graphOf, GraphRole, kFaceKinds } from "./shapes";
import type { Graph, GraphNode } from "./shapes";
import { lengthText } from "./words";

const kLetters = [["f", "v"], ["v", "f"], ["e", "e"]];
const kKindTexts = ["face of the part, vertex", "vertex of the part, face", "edge, edge"];
/** Nodes change no more often than an eye follows. */
const kNodes_ms = 200;
const kSvg = "http://www.w3.org/2000/svg";

/** "44 B (v2, f0)": the number of the paper, type, feature of the part and of the other piece. */
export function nodeText({ node, kind, ofA, ofB }: GraphNode): string {
  return `${node} ${kFaceKinds[kind]} (${kLetters[kind][0]}${ofA}, ${kLetters[kind][1]}${ofB})`;
}

/** Where the nodes stand, -1 to 1: those that hold or are near inside, their neighbours round them, each near to what
 * it is a neighbour of. The same graph is laid out the same way. */
export function layoutOf(graph: Graph): [number, number][] {
  const inner = graph.nodes.map((n, k) => (n.role === GraphRole.neighbor ? -1 : k)).filter((k) => k >= 0);
  const outer = graph.nodes.map((n, k) => (n.role === GraphRole.neighbor ? k : -1)).filter((k) => k >= 0);
  const places: [number, number][] = graph.nodes.map(() => [0, 0]);
  const ring = (list: number[], radius: number, turn: number) =>
    list.forEach((k, i) => {
      const angle = turn + (2 * Math.PI * i) / list.length;
      places[k] = [radius * Math.sin(angle), -radius * Math.cos(angle)];
    });
  ring(inner, inner.length > 12 ? 0.6 : inner.length > 1 ? 0.42 : 0, 0);
  const pull = new Map<number, number>();
  for (const k of outer) {
    let x = 0, y = 0;
    for (const [a, b] of graph.arcs) {
      const other = a === k ? b : b === k ? a : -1;
      if (other >= 0 && graph.nodes[other].role !== GraphRole.neighbor) (x += places[other][0]), (y += places[other][1]);
    }
    pull.set(k, Math.atan2(x, -y));
  }
  const sorted = [...outer].sort((a, b) => pull.get(a)! - pull.get(b)! || graph.nodes[a].node - graph.nodes[b].node);
  ring(sorted, 0.9, sorted.length > 0 ? pull.get(sorted[0])! : 0);
  return places;
}

function create(name: string, attributes: Record<string, string | number>): SVGElement {
  const element = document.createElementNS(kSvg, name) as SVGElement;
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, String(value));
  return element;
}

export class GraphPane {
  private readonly svg: SVGSVGElement;
  private readonly words: HTMLElement;
  private shown = "";
  private drawn = -Infinity;
  private width = 0;
  private height = 0;
  private graph: Graph | null = null;
  private bodies: string[] = [];
  private selected: { pair: number; node: number } | null = null;
  onSelect: (selected: { pair: number; node: number } | null) => void = () => {};

  constructor(box: HTMLElement) {
    this.svg = box.querySelector("svg")!;
    this.words = box.querySelector(".graph-words")!;
    this.svg.addEventListener("click", (event) => this.choose((event.target as Element).closest("[data-node]")));
    this.svg.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      this.choose((event.target as Element).closest("[data-node]"));
      event.preventDefault();
      event.stopPropagation();
    });
  }

  load(bodies: string[]): void {
    this.bodies = bodies;
  }

  private choose(element: Element | null): void {
    const node = element === null ? -1 : Number(element.getAttribute("data-node"));
    const again = this.selected !== null && this.selected.node === node && this.selected.pair === this.graph?.pair;
    this.selected = element === null || again || !this.graph ? null : { pair: this.graph.pair, node };
    this.onSelect(this.selected);
    this.shown = "";
    if (this.graph) this.draw(this.graph);
  }

  /** `now` [ms]; false: the nodes were drawn too lately, and are to be shown once more. */
  show(answer: Answer, now: number): boolean {
    this.graph = graphOf(answer);
    const isDue = now - this.drawn > kNodes_ms;
    return this.draw(this.graph, isDue ? now : 0);
  }

  resize(): void {
    this.width = this.svg.clientWidth;
    this.height = this.svg.clientHeight;
    this.shown = "";
    if (this.graph) this.draw(this.graph);
  }

  /** `now`: when the nodes may be drawn; 0: not now. Returns whether they are those of the graph. */
  private draw(graph: Graph | null, now = performance.now()): boolean {
    const { width, height } = this;
    const key = graph
      ? `${graph.pair}:${graph.nodes.map((n) => `${n.node}${n.role}${n.applies ? "+" : "-"}`).join()}:${width}x${height}`
      : "none";
    if (key !== this.shown && now > 0) {
      this.shown = key;
      this.drawn = now;
      this.svg.replaceChildren();
      if (graph && width > 0) this.drawNodes(graph, width, height);
    }
    this.describe(graph);
    return key === this.shown;
  }

  private drawNodes(graph: Graph, width: number, height: number): void {
    const places = layoutOf(graph);
    const x = (k: number) => width / 2 + places[k][0] * (width / 2 - 22);
    const y = (k: number) => height / 2 + places[k][1] * (height / 2 - 16);
    for (const [a, b] of graph.arcs) {
      this.svg.append(create("line", { x1: x(a), y1: y(a), x2: x(b), y2: y(b), class: "arc" }));
    }
    const crowded = graph.nodes.length > 30;
    const crowd = graph.nodes.filter((n) => n.role !== GraphRole.neighbor).length;
    graph.nodes.forEach((node, k) => {
      const isCore = node.role !== GraphRole.neighbor;
      const chosen = this.selected?.pair === graph.pair && this.selected.node === node.node;
      const r = isCore ? (crowd > 12 ? 5.5 : 8) : crowded ? 3.5 : 5.5;
      const group = create("g", {
        "data-node": node.node,
        class: `node ${["neighbor", "near", "holds"][node.role]} kind${node.kind}${node.applies ? "" : " inapplicable"}${chosen ? " chosen" : ""}`,
        tabindex: isCore ? 0 : -1,
        role: "button",
        "aria-label": `basic contact ${nodeText(node)}`,
      });
      const [cx, cy] = [x(k), y(k)];
      if (node.kind === 0) group.append(create("rect", { x: cx - r, y: cy - r, width: 2 * r, height: 2 * r }));
      else if (node.kind === 1) group.append(create("circle", { cx, cy, r: 1.1 * r }));
      else group.append(create("path", { d: `M${cx} ${cy - 1.3 * r}L${cx + 1.3 * r} ${cy}L${cx} ${cy + 1.3 * r}L${cx - 1.3 * r} ${cy}Z` }));
      if ((isCore && crowd <= 8) || chosen) {
        const label = create("text", { x: cx, y: cy - r - 4, "text-anchor": "middle" });
        label.textContent = String(node.node);
        group.append(label);
      }
      const title = create("title", {});
      title.textContent = nodeText(node);
      group.append(title);
      this.svg.append(group);
    });
  }

  private describe(graph: Graph | null): void {
    const lines: string[] = [];
    if (!graph) {
      lines.push("no pair is near");
    } else {
      lines.push(`pair ${graph.pair} with ${this.bodies[graph.body] ?? "?"}`);
      const chosen = this.selected?.pair === graph.pair ? graph.nodes.find((n) => n.node === this.selected!.node) : undefined;
      if (chosen) {
        lines.push(nodeText(chosen), kKindTexts[chosen.kind]);
        lines.push(chosen.applies ? `plane at ${lengthText(chosen.depth)}` : "not applicable here");
        lines.push(["a neighbour", "near", "holds the part"][chosen.role]);
      } else {
        const count = (role: GraphRole) => graph.nodes.filter((n) => n.role === role).length;
        lines.push(`${count(GraphRole.holds)} hold, ${count(GraphRole.near)} near, ${count(GraphRole.neighbor)} neighbours`);
        if (graph.leftOut > 0) lines.push("more are left out");
        lines.push("click one for its features");
      }
    }
    const text = lines.join("\n");
    if (this.words.textContent !== text) this.words.textContent = text;
  }
}
