// The player: a slider of time, a button, keys, and the clock, on top of Meshcat's animator.

// Times are in single precision: one that is this near to a frame's is the frame's [s].
const AT_FRAME = 1e-3;
// Before a motion begins again, its end is shown so long [ms].
const PAUSE = 900;

class Player {
  constructor(animator) {
    this.animator = animator;
    this.time = 0; // shown; after the end Meshcat's own clock goes back to 0 while the end is shown
    this.ran = false;
    this.ended = null; // when it came to its end, if it is to begin again
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

  // A motion; where another one was shown, its time is kept, and it goes on if that was running.
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

  // The last frame that begins no later than a time
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

  // To the waypoint before or after
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
      this.seek(this.time); // the picture of a time is the same, whether it is played or sought
    } else {
      this.seek(this.time >= this.animator.duration - 1e-6 ? 0 : this.time);
      this.animator.play();
    }
  }

  key(event) {
    // With these the keys are the browser's: Alt and an arrow go back a page.
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    // Lists have a use of their own for these keys; what is clicked, for space.
    if (event.target.closest("select")) return;
    if (event.key === " " && event.target.closest("button, summary, input:not(#scrub)")) return;
    const key = event.shiftKey && event.key.startsWith("Arrow") ? `Shift ${event.key}` : event.key;
    if (!Object.hasOwn(this.uses, key)) return;
    this.uses[key]();
    event.preventDefault();
  }

  // Show where the animation is.
  update() {
    const { animator, slider } = this;
    if (animator.playing) {
      this.time = animator.time;
      this.ran = true;
    } else if (this.ran) {
      // It has come to its end by itself: Meshcat shows the last frame.
      if (animator.time < 1e-9 || animator.time >= animator.duration) this.time = animator.duration;
      this.ran = false;
      this.ended = this.loops ? performance.now() : null;
    } else if (this.ended !== null) {
      if (performance.now() - this.ended > PAUSE) {
        this.seek(0);
        animator.play();
      }
    }
    // Only what has changed is written: a scene at rest costs no drawing.
    const write = (element, name, value) => { if (element[name] !== value) element[name] = value; };
    if (Math.abs(slider.value - this.time) > 1e-6) slider.value = this.time;
    const { length, per_metre: factor } = this.units;
    const speed = this.speeds ? `  ${(factor * this.speeds[this.frame()]).toFixed(factor > 1 ? 0 : 3)} ${length}/s` : "";
    write(byId("clock"), "textContent", `${(this.start + this.time).toFixed(2)} s${speed}`);
    write(byId("play"), "textContent", this.running ? "❚❚" : "▶");
    write(byId("play"), "ariaLabel", this.running ? "pause" : "play");
  }
}
