// Keyboard and gamepad, as fractions of the largest twist: [vx, vy, wz] from -1 to 1.

const KEYS = {
  KeyW: [0, 1], ArrowUp: [0, 1], KeyS: [0, -1], ArrowDown: [0, -1],
  KeyA: [1, 1], KeyD: [1, -1],
  KeyQ: [2, 1], ArrowLeft: [2, 1], KeyE: [2, -1], ArrowRight: [2, -1],
};
const KEY_SHARE = 0.5;
const SLOW_SHARE = 1 / 3;
const DEAD_ZONE = 0.12;
const BUTTON_B = 1;

/**
 * Listens to the keyboard.
 * @param {boolean} sideways Whether the robot can go sideways; if not, A and D turn it.
 * @param {(axis: number, fraction: number) => void} drive Called when what is held changes, with 0 upon release.
 * @param {() => void} stop Called for Space and Escape.
 */
export function listenToKeys(sideways, drive, stop) {
  const held = new Map();
  const axisOf = (code) => (KEYS[code][0] === 1 && !sideways ? 2 : KEYS[code][0]);
  const apply = (axis, slow) => {
    let sum = 0;
    for (const code of held.keys()) if (axisOf(code) === axis) sum += KEYS[code][1];
    drive(axis, Math.sign(sum) * KEY_SHARE * (slow ? SLOW_SHARE : 1));
  };
  const heldAxes = () => new Set([...held.keys()].map(axisOf));
  const release = () => {
    const axes = heldAxes();
    held.clear();
    axes.forEach((axis) => apply(axis, false));
  };

  window.addEventListener("keydown", (event) => {
    if (event.key === "Meta") release(); // While it is down, some systems tell nothing of keys that are let go.
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.code === "Space" || event.code === "Escape") {
      // Space stops, wherever the focus is; Enter presses buttons.
      event.preventDefault();
      held.clear();
      stop();
    } else if (event.key === "Shift") {
      heldAxes().forEach((axis) => apply(axis, true));
    } else if (event.code in KEYS) {
      // Arrow keys move a slider that has the focus.
      if (event.code.startsWith("Arrow") && event.target.type === "range") return;
      event.preventDefault();
      // A key that was held when Stop came drives again when it is pressed anew.
      if (event.repeat || held.has(event.code)) return;
      held.set(event.code, true);
      apply(axisOf(event.code), event.shiftKey);
    }
  });
  window.addEventListener("keyup", (event) => {
    if (event.code === "Space") event.preventDefault();
    if (event.key === "Meta") release();
    if (event.key === "Shift") heldAxes().forEach((axis) => apply(axis, false));
    if (!held.delete(event.code)) return;
    apply(axisOf(event.code), event.shiftKey);
  });
  window.addEventListener("blur", release);
}

/**
 * Looks at the first gamepad; to be called again and again.
 * @returns {(sideways: boolean) => {twist: number[] | null, stop: boolean}} The twist while a stick is moved, and once
 *   more, zero, when it is let go.
 */
export function gamepadReader() {
  let moved = false;
  let pressed = false;
  return (sideways) => {
    const pads = navigator.getGamepads ? [...navigator.getGamepads()] : [];
    const pad = pads.find((each) => each && each.connected);
    const axis = (index) => {
      const value = (pad && pad.axes[index]) || 0;
      return Math.abs(value) < DEAD_ZONE ? 0 : Math.sign(value) * (Math.abs(value) - DEAD_ZONE) / (1 - DEAD_ZONE);
    };
    const left = -axis(0);
    const twist = sideways ? [-axis(1), left, -axis(2)] : [-axis(1), 0, -axis(2) || left];
    const now = twist.some((value) => value !== 0);
    const used = now || moved;
    moved = now;
    const button = Boolean(pad && pad.buttons[BUTTON_B] && pad.buttons[BUTTON_B].pressed);
    const stop = button && !pressed;
    pressed = button;
    return { twist: used && !button ? twist : null, stop };
  };
}
