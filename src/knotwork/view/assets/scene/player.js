// The player has a slider of time, a button, keys and a clock, and drives Meshcat's animator.

// Times have single precision, so a time this near to a frame's is equal to it [s].
const AT_FRAME = 1e-3;
// The end of a motion is shown for this time before it begins again [ms].
const PAUSE = 900;

class Player {
  constructor(animator) {
    this.animator = animator;
    this.time = 0; // the time shown; Meshcat's clock returns to 0 while the end is shown
    this.ran = false;
    this.ended = null; // when the motion ended, if it is to begin again
    this.loops = true;
    this.slider = byId("scrub");
    this.slider.addEventListener("input", () => this.seek(Number(this.slider.value)));
    byId("play").addEventListener("click", () => this.toggle());
    byId("loop").addEventListener("click", () => this.loop(!this.loops));
    byId("rate").addEventListener("change", () => this.setRate());
    byId("keys").addEventListener("click", () => this.showKeys(false));
    byId("help").addEventListener("click", () => this.showKeys(byId("keys").hidden));
    this.uses = {
      " ": () => this.toggle(),
      ArrowLeft: () => this.step(-1),
      ArrowRight: () => this.step(1),
      Home: () => this.seek(0),
      End: () => this.seek(this.animator.duration),
      n: () => this.toWaypoint(1),
      p: () => this.toWaypoint(-1),
      l: () => this.loop(!this.loops),
      "?": () => this.showKeys(byId("keys").hidden),
      Escape: () => this.showKeys(false),
    };
    document.addEventListener("keydown", (event) => this.key(event));
  }

  // Show a motion. The time of the previous one is kept, and the motion runs if that one did.
  set(data) {
    const { arm } = data;
    const running = this.running;
    const shown = this.start + this.time;
    this.start = arm.start;
    this.times = floats(arm.time);
    this.units = data.units;
    this.speeds = arm.speed ? floats(arm.speed) : null;
    this.stops = data.waypoints.map((stop) => stop.time - arm.start);
    this.slider.max = this.animator.duration || 1;
    this.setRate();
    if (Number.isNaN(shown)) return;
    this.seek(shown - this.start);
    if (running) this.animator.play();
  }

  setRate() {
    this.animator.mixer.timeScale = Number(byId("rate").value);
  }

  get running() {
    return this.animator.playing || this.ended !== null;
  }

  loop(on) {
    this.loops = on;
    if (!on) this.ended = null;
    byId("loop").ariaPressed = String(on);
  }

  showKeys(on) {
    byId("keys").hidden = !on;
  }

  // The last frame that does not begin after a time
  frame(time = this.time) {
    let [low, high] = [0, this.times.length - 1];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.times[middle] <= time + AT_FRAME) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  seek(time) {
    const { animator } = this;
    const within = Math.min(Math.max(time, 0), animator.duration);
    const frame = this.times[this.frame(within)];
    this.time = Math.abs(frame - within) < AT_FRAME ? frame : within;
    if (animator.playing) animator.pause();
    for (const action of animator.actions) {
      action.paused = false;
      action.play();
    }
    animator.seek(this.time);
    animator.time = this.time;
    this.ran = false;
    this.ended = null;
  }

  // Go to the previous or the next waypoint.
  toWaypoint(side) {
    const beyond = this.stops.filter((time) => side * (time - this.time) > AT_FRAME);
    if (beyond.length) this.seek(side > 0 ? Math.min(...beyond) : Math.max(...beyond));
  }

  step(count) {
    const frame = this.frame() + count;
    this.seek(this.times[Math.min(Math.max(frame, 0), this.times.length - 1)]);
  }

  toggle() {
    if (this.running) {
      this.seek(this.time); // a time looks the same, whether it is played or sought
    } else {
      this.seek(this.time >= this.animator.duration - 1e-6 ? 0 : this.time);
      this.animator.play();
    }
  }

  key(event) {
    // With these modifiers keys belong to the browser: Alt and an arrow go back a page.
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    // Lists use these keys themselves, and buttons the space bar.
    if (event.target.closest("select")) return;
    if (event.key === " " && event.target.closest("button, summary, input:not(#scrub)")) return;
    const key = event.shiftKey && event.key.startsWith("Arrow") ? `Shift ${event.key}` : event.key;
    if (!Object.hasOwn(this.uses, key)) return;
    this.uses[key]();
    event.preventDefault();
  }

  // Show the time of the animation.
  update() {
    const { animator, slider } = this;
    if (animator.playing) {
      this.time = animator.time;
      this.ran = true;
    } else if (this.ran) {
      // The animation has ended by itself, and Meshcat shows the last frame.
      if (animator.time < 1e-9 || animator.time >= animator.duration) this.time = animator.duration;
      this.ran = false;
      this.ended = this.loops ? performance.now() : null;
    } else if (this.ended !== null) {
      if (performance.now() - this.ended > PAUSE) {
        this.seek(0);
        animator.play();
      }
    }
    // Only changes are written, so that a scene at rest is not drawn again.
    const write = (element, name, value) => { if (element[name] !== value) element[name] = value; };
    if (Math.abs(slider.value - this.time) > 1e-6) slider.value = this.time;
    const { length, per_metre: factor } = this.units;
    const speed = this.speeds ? `  ${(factor * this.speeds[this.frame()]).toFixed(factor > 1 ? 0 : 3)} ${length}/s` : "";
    write(byId("clock"), "textContent", `${(this.start + this.time).toFixed(2)} s${speed}`);
    write(byId("play"), "textContent", this.running ? "❚❚" : "▶");
    write(byId("play"), "ariaLabel", this.running ? "pause" : "play");
  }
}
