// SPDX-License-Identifier: Apache-2.0
// Colours that people with any colour vision can tell apart (after Okabe and Ito), on light and dark ground. Nothing is
// told by colour alone.

export interface Colours {
  ground: string;
  ink: string;
  grid: string;
  fixed: string;
  section: string;
  fixedEdge: string;
  felt: string;
  feltEdge: string;
  device: string;
  /** a part that its owner moves; its edges, and where its owner has it */
  driven: string;
  drivenEdge: string;
  commanded: string;
  force: string;
  torque: string;
  /** force that leads the hand along the plan */
  guide: string;
  contact: string;
  /** the basic contact that was clicked */
  chosen: string;
  /** faces of types A, B, C, and of several types */
  kinds: [string, string, string, string];
}

const kKinds: Colours["kinds"] = ["#e69f00", "#56b4e9", "#009e73", "#b9a6c9"];

export const kLight: Colours = {
  ground: "#fbfbf9",
  ink: "#1b1f24",
  grid: "#d5d8dc",
  fixed: "#c3c9d0",
  section: "#8d969f",
  fixedEdge: "#5b646e",
  felt: "#4c86b5",
  feltEdge: "#173a55",
  device: "#7a5a00",
  driven: "#9a8cc4",
  drivenEdge: "#3d2f66",
  commanded: "#6a3fb5",
  force: "#d55e00",
  torque: "#0061a8",
  guide: "#00795a",
  contact: "#c2187f",
  chosen: "#0061a8",
  kinds: kKinds,
};

export const kDark: Colours = {
  ground: "#14181d",
  ink: "#e8eaed",
  grid: "#333a42",
  fixed: "#6c7782",
  section: "#47515b",
  fixedEdge: "#a5afb9",
  felt: "#5a9ccf",
  feltEdge: "#d4ebfb",
  device: "#f0e442",
  driven: "#8577b8",
  drivenEdge: "#ddd4fb",
  commanded: "#b79bff",
  force: "#ff8a3d",
  torque: "#7cc4ff",
  guide: "#4fd6a8",
  contact: "#ff7ac4",
  chosen: "#7cc4ff",
  kinds: kKinds,
};
