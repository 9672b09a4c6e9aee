// Drives the robot: sliders, keys and gamepad go to the server 20 times a second, its states come back.

import { gamepadReader, listenToKeys } from "./input.js";
import { byId, fixed, legPanel, readout, showKeys, twistPanel, wheelPanel, wrapped } from "./view.js";

const SEND_TIME = 50; // ms
const RETRY_TIME = 1000; // ms
const CLAIM_TIME = 1000; // ms for which a page that was touched takes itself to drive, before the server says so

const gamepad = gamepadReader();
let socket = null;
let hello = null;
let me = 0;
let state = null;
let touches = 0;
let touched = -Infinity;
let mode = "twist";
let choice = {};
let panels = null;

const drives = () => (state && state.driver === me) || performance.now() - touched < CLAIM_TIME;
const values = (controls) => Object.fromEntries(Object.entries(controls).map(([name, { input }]) => [name, Number(input.value)]));

function command() {
  const message = { touch: touches, lapses: state ? state.lapses : 0, mode };
  if (mode === "twist") message.twist = panels.twist.inputs.map((input) => Number(input.value));
  if (mode === "wheels") message.wheels = values(panels.wheels.wheels);
  if (mode === "wheels") message.steering = values(panels.wheels.steering);
  if (panels.legs) Object.assign(message, choice, { body: panels.legs.body.map((input) => Number(input.value)) });
  return message;
}

function send(action) {
  if (!panels || !socket || socket.readyState !== WebSocket.OPEN) return;
  if (action || (touches > 0 && drives())) socket.send(JSON.stringify(action ? { ...command(), action } : command()));
}

function touch(newMode) {
  touches += 1;
  touched = performance.now();
  mode = newMode;
  send();
  show();
}

function zero() {
  panels.twist.inputs.forEach((input) => { input.value = 0; });
  if (panels.wheels) Object.values(panels.wheels.wheels).forEach(({ input }) => { input.value = 0; });
}

function stop() {
  if (!panels) return;
  zero();
  touch("twist");
}

function reset() {
  stop();
  if (panels.legs) panels.legs.body.forEach((input) => { input.value = 0; });
  if (panels.legs) choice = { ...choice, posture: hello.postures[0], motion: "walk" };
  send("reset");
}

function driveAxis(axis, fraction) {
  const input = panels.twist.inputs[axis];
  if (input.disabled) return;
  if (mode !== "twist") zero();
  input.value = fraction * hello.axes[axis].largest;
  touch("twist");
}

function pollGamepad() {
  const { twist, stop: wanted } = gamepad(!hello.axes[1].reason);
  if (wanted) stop();
  if (!twist) return;
  panels.twist.inputs.forEach((input, axis) => { if (!input.disabled) input.value = twist[axis] * hello.axes[axis].largest; });
  touch("twist");
}

// What others ask for, and what our own command means for the other panel.
function follow() {
  const mine = drives();
  if (!mine) mode = state.mode;
  if (!(mine && mode === "twist")) panels.twist.inputs.forEach((input, axis) => { input.value = state.twist[axis]; });
  if (panels.wheels && !(mine && mode === "wheels")) {
    for (const [name, { input }] of Object.entries(panels.wheels.wheels)) input.value = state.wheels[name].target;
    for (const [name, { input }] of Object.entries(panels.wheels.steering)) input.value = wrapped(state.steering[name].target);
  }
  if (panels.legs && !mine) {
    choice = { ...state.asked };
    panels.legs.body.forEach((input, index) => { input.value = state.body[index]; });
  }
}

function show() {
  if (!state) return;
  panels.twist.show();
  if (panels.wheels) panels.wheels.show(state);
  if (panels.legs) panels.legs.show(state, choice);
  panels.readout(state);
  byId("twist").classList.toggle("drives", mode === "twist");
  byId("wheels").classList.toggle("drives", mode === "wheels");
  const who = state.driver === null ? "nobody drives" : state.driver === me ? "you drive" : "another page drives";
  byId("status").textContent = `${fixed(state.time, 1)} s · ${fixed(state.factor, 2)} × real time · ${who}`;
  const slow = state.factor < 0.9 ? ["slower than real time: this machine cannot keep up"] : [];
  byId("notes").textContent = [...state.notes, ...slow].join(" · ");
  alertOf(state.fault ? `The simulation stopped: ${state.fault}. Reset starts again.`
    : state.late ? `No word from the page that drives for ${hello.timeout} s: the robot stops until a control is moved anew.` : "");
}

function alertOf(text) {
  const element = byId("alert");
  if (element.textContent !== text) element.textContent = text;
  element.hidden = !text;
}

function build() {
  byId("robot").textContent = hello.robot;
  byId("robot").title = hello.summary;
  document.title = `${hello.robot} · rollerbench teleop`;
  byId("scene").src = `http://${location.hostname}:${hello.meshcat_port}/`;
  panels = {
    twist: twistPanel(hello.axes, () => touch("twist")),
    wheels: hello.wheels ? wheelPanel(hello, () => touch("wheels")) : null,
    legs: hello.legs ? legPanel(hello, (kind, value) => { choice = { ...choice, [kind]: value }; touch("twist"); },
      () => touch("twist")) : null,
    readout: readout(),
  };
  if (hello.legs) choice = { posture: hello.postures[0], motion: "walk", gait: hello.gaits[0], change: "stepping" };
  const sideways = !hello.axes[1].reason;
  showKeys(sideways);
  listenToKeys(sideways, driveAxis, stop);
  byId("stop").addEventListener("click", stop);
  byId("reset").addEventListener("click", reset);
  document.querySelectorAll("[data-camera]").forEach((button) => {
    button.addEventListener("click", () => send(button.dataset.camera));
  });
  document.addEventListener("visibilitychange", () => { if (document.hidden && drives()) stop(); });
  // A click into the scene takes the keyboard away from this page: give it back, so that Space stops.
  window.addEventListener("blur", () => setTimeout(() => {
    if (document.activeElement !== byId("scene")) return;
    byId("scene").blur();
    window.focus();
  }));
  setInterval(() => { if (!document.hidden) { pollGamepad(); send(); } }, SEND_TIME);
}

function connect() {
  socket = new WebSocket(`ws://${location.host}/socket`);
  socket.onmessage = (event) => {
    const message = JSON.parse(event.data);
    if (message.kind === "hello") {
      if (hello && JSON.stringify({ ...message, you: hello.you }) !== JSON.stringify(hello)) location.reload();
      hello = message;
      me = message.you;
      if (!panels) build();
      touches = 0;
      touched = -Infinity;
    } else {
      if (state && state.driver === me && message.driver !== me) {
        // Another page took over, or the robot was stopped: what was asked for here no longer counts.
        zero();
        touched = -Infinity;
      }
      state = message;
      follow();
      show();
    }
  };
  socket.onclose = () => {
    state = null;
    if (panels) zero();
    byId("status").textContent = "not connected";
    alertOf("The simulation does not answer. The robot stands still, or it has ended.");
    setTimeout(connect, RETRY_TIME);
  };
}

connect();
