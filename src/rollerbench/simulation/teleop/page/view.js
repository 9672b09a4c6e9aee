// What the page shows: builds controls for a robot, and fills in the numbers.

const DEGREES = 180 / Math.PI;
const AXES = [["vx", "forward", "m/s"], ["vy", "left", "m/s"], ["wz", "turn left", "rad/s"]];

export const byId = (id) => document.getElementById(id);

/** Makes an element with attributes and children; texts are texts, never HTML. */
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

export const fixed = (value, digits) => {
  const text = value.toFixed(digits);
  return Number(text) === 0 ? (0).toFixed(digits) : text.replace("-", "\u2212");
};

const words = (name) => name.replaceAll("_", " ");

/** A slider about zero, which tells when its user moves it. */
export function slider(label, largest, moved, disabled = false) {
  const input = make("input", {
    type: "range", min: -largest, max: largest, step: "any", value: 0, "aria-label": label, disabled,
  });
  input.addEventListener("input", moved);
  return input;
}

const digitsFor = (largest) => (largest < 10 ? 2 : 1);

/** Rows of the twist sliders; returns them with what fills in their numbers. */
export function twistPanel(axes, moved) {
  const rows = axes.map((axis, index) => {
    const [name, what, unit] = AXES[index];
    const input = slider(`${name}, ${what} [${unit}]`, axis.largest, moved, Boolean(axis.reason));
    const number = make("output", { class: "numbers" }, "0.00");
    const row = make("label", { class: "axis", title: axis.reason || undefined },
      make("span", {}, make("b", {}, name), ` ${what}`), input, number, make("span", { class: "unit" }, unit));
    if (axis.reason) row.append(make("small", {}, axis.reason));
    byId("twist").append(row);
    return { input, number, digits: digitsFor(axis.largest) };
  });
  return {
    inputs: rows.map((row) => row.input),
    show: () => rows.forEach((row) => { row.number.value = fixed(Number(row.input.value), row.digits); }),
  };
}

/** Adds a table; heads are texts, or a text and over how many columns it stands. Returns what adds a row. */
function table(parent, caption, heads) {
  const body = make("tbody");
  const cells = heads.map((head) => {
    const [text, span] = [head].flat();
    return make("th", { scope: "col", colspan: span, class: text }, text);
  });
  parent.append(make("table", {}, make("caption", {}, caption), make("thead", {}, make("tr", {}, ...cells)), body));
  return (name, ...cells) => {
    const row = make("tr", {}, make("th", { scope: "row" }, words(name)));
    const made = cells.map((cell) => make("td", { class: cell ? "" : "numbers" }, ...(cell ? [cell] : [])));
    row.append(...made);
    body.append(row);
    return made;
  };
}

/** Sliders and numbers of the wheels; steered ones in a table of their own. */
export function wheelPanel(hello, moved) {
  const parent = byId("wheels");
  parent.hidden = false;
  const wheels = {};
  const steering = {};
  const slips = {};
  const add = table(parent, "Speeds [rad/s]; slip [mm/s]", ["wheel", ["asked", 2], "told", "turns", "slip"]);
  for (const wheel of hello.wheels) {
    const input = slider(`${words(wheel.name)}, speed [rad/s]`, wheel.largest, moved);
    const [, ...cells] = add(wheel.name, input, "", "", "", "");
    wheels[wheel.name] = { input, cells };
    slips[wheel.name] = cells[3];
  }
  for (const name of hello.passive) slips[name] = add(name, "", "", "", "", "")[4];
  if (hello.steered.length) {
    const addSteered = table(parent, "Steering [deg]", ["wheel", ["asked", 2], "told", "looks"]);
    for (const name of hello.steered) {
      const input = slider(`${words(name)}, steering angle [deg]`, 180, moved);
      const [, ...cells] = addSteered(name, input, "", "", "");
      steering[name] = { input, cells };
    }
  }
  const contradiction = make("p", { class: "numbers" });
  parent.append(contradiction);
  return {
    wheels, steering,
    show(state) {
      for (const [name, { input, cells }] of Object.entries(wheels)) {
        const wheel = state.wheels[name];
        cells[0].textContent = fixed(Number(input.value), 1);
        cells[1].textContent = fixed(wheel.told, 1);
        cells[2].textContent = fixed(wheel.measured, 1);
      }
      for (const [name, slip] of Object.entries(state.slip)) slips[name].textContent = fixed(1e3 * slip, 0);
      for (const [name, { input, cells }] of Object.entries(steering)) {
        const wheel = state.steering[name];
        cells[0].textContent = fixed(Number(input.value), 0);
        cells[1].textContent = fixed(wrapped(wheel.told), 0);
        cells[2].textContent = fixed(wrapped(wheel.measured), 0);
      }
      const slide = 1e3 * state.contradiction;
      contradiction.textContent = slide < 0.5 ? "The wheels agree."
        : `The wheels contradict each other: one must slide by ${fixed(slide, 0)} mm/s.`;
      contradiction.classList.toggle("warn", slide >= 0.5);
    },
  };
}

/** An angle in degrees from -180 to 180. */
export function wrapped(radians) {
  const turn = radians * DEGREES;
  return turn - 360 * Math.round(turn / 360);
}

/** Postures, gaits and pose of the body; numbers of the feet. */
export function legPanel(hello, chosen, moved) {
  const parent = byId("legs");
  parent.hidden = false;
  const choices = {
    posture: hello.postures, motion: hello.drives ? ["walk", "drive"] : ["walk"], gait: hello.gaits,
    change: hello.drives ? ["stepping", "rolling"] : ["stepping"],
  };
  const titles = { posture: "Posture", motion: "Move by", gait: "Gait", change: "Change by" };
  const buttons = [];
  for (const [kind, values] of Object.entries(choices)) {
    const group = make("div", { class: "choice", role: "group", "aria-label": titles[kind] }, make("span", {}, titles[kind]));
    for (const value of values) {
      const button = make("button", { type: "button", "aria-pressed": "false" }, value);
      button.addEventListener("click", () => chosen(kind, value));
      buttons.push([kind, value, button]);
      group.append(button);
    }
    parent.append(group);
  }
  const body = hello.body.map((axis) => {
    const unit = axis.name === "height" ? "mm" : "deg";
    const input = slider(`body ${axis.name} [${unit}]`, axis.largest, moved);
    const number = make("output", { class: "numbers" });
    parent.append(make("label", { class: "axis" }, make("span", {}, "body ", make("b", {}, axis.name)), input, number,
      make("span", { class: "unit" }, unit)));
    return { input, number };
  });
  const doing = make("p");
  parent.append(doing);
  const add = table(parent, "Feet", ["foot", "", "load [N]", "slip [mm/s]"]);
  const feet = Object.fromEntries(hello.legs.map((name) => [name, add(name, "", "", "")]));
  return {
    body: body.map(({ input }) => input),
    show(state, choice) {
      for (const [kind, value, button] of buttons) button.setAttribute("aria-pressed", String(choice[kind] === value));
      body.forEach(({ input, number }, index) => { number.value = fixed(Number(input.value), index ? 1 : 0); });
      doing.textContent = `Stands in: ${state.stands_in}. Does: ${state.activity}.`;
      for (const [name, cells] of Object.entries(feet)) {
        const foot = state.feet[name];
        cells[0].textContent = foot.stands ? "stands" : "in the air";
        cells[1].textContent = fixed(foot.load, 0);
        cells[2].textContent = fixed(1e3 * foot.slip, 0);
      }
    },
  };
}

/** Pose and twist, simulated and as the equations say. */
export function readout() {
  const parent = byId("readout");
  const add = table(parent, "Pose and its error", ["", "simulated", "equations", "error"]);
  const cells = [add("x [m]", "", "", ""), add("y [m]", "", "", ""), add("yaw [deg]", "", "", "")];
  const error = make("p", { class: "numbers error" });
  parent.append(error);
  return (state) => {
    cells.forEach((row, index) => {
      const angle = index === 2;
      const [simulated, ghost] = [state.pose[index], state.ghost[index]];
      const difference = angle ? wrapped(simulated - ghost) : simulated - ghost;
      row[0].textContent = angle ? fixed(wrapped(simulated), 1) : fixed(simulated, 3);
      row[1].textContent = angle ? fixed(wrapped(ghost), 1) : fixed(ghost, 3);
      row[2].textContent = fixed(difference, angle ? 2 : 4);
    });
    const [distance, turn] = state.error;
    error.textContent = `Pose error ${fixed(1e3 * distance, 1)} mm, ${fixed(turn * DEGREES, 2)} deg`;
  };
}

/** Keys, in words. */
export function showKeys(sideways) {
  const keys = (...names) => names.map((name) => make("kbd", {}, name));
  byId("keys").append(
    ...keys("W", "S", "\u2191", "\u2193"), " drive, ",
    ...(sideways ? [...keys("A", "D"), " go sideways, "] : []),
    ...keys(...(sideways ? [] : ["A", "D"]), "Q", "E", "\u2190", "\u2192"), " turn, at half of the sliders' range while held; ",
    ...keys("Shift"), " slow; ", ...keys("Space", "Esc"), " stop. ",
    "Gamepad: left stick drives, right stick turns, B stops.",
  );
}
