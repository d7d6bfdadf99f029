// A moving arm with its controls: a slider, a button that plays, a choice of speeds. How it is
// drawn is said by what is derived from this: addShapes() and pose(low, high, share).
'use strict';

// the name space of SVG, without its address: the page names no place on the network
const holder = document.createElement('div');
holder.innerHTML = '<svg></svg>';
const SVG = holder.firstChild.namespaceURI;

function drawing(tag, parent, attributes = {}) {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  if (parent) parent.appendChild(made);
  return made;
}

// Numbers between two lists of them.
function between(low, high, share) {
  return low.map((value, i) => value + share * (high[i] - value));
}

class Player {
  // tell(time) is called with the time that is shown
  constructor(spec, parent, tell, caption) {
    Object.assign(this, { spec, tell, playing: false });
    this.figure = element('figure', parent);
    this.figure.id = 'arm';
    element('figcaption', this.figure, caption);
    this.addShapes();
    this.addControls();
    this.show(spec.times[0]);
  }

  addControls() {
    const { times } = this.spec;
    const controls = element('div', this.figure, '', 'controls');
    this.button = element('button', controls, 'Play');
    this.button.type = 'button';
    this.button.addEventListener('click', () => (this.playing ? this.pause() : this.play()));
    this.slider = element('input', controls);
    Object.assign(this.slider, { type: 'range', min: times[0], max: times[times.length - 1],
      step: (times[times.length - 1] - times[0]) / 1000, value: times[0] });
    this.slider.setAttribute('aria-label', 'time [s]');
    this.slider.addEventListener('input', () => {
      this.pause();
      this.show(Number(this.slider.value));
    });
    this.readout = element('output', controls);
    this.speed = element('select', controls);
    this.speed.setAttribute('aria-label', 'speed');
    for (const [name, factor] of [['real time', 1], ['1/2', 0.5], ['1/5', 0.2], ['1/20', 0.05]]) {
      element('option', this.speed, name).value = factor;
    }
  }

  play() {
    const last = this.spec.times[this.spec.times.length - 1];
    if (this.time >= last) this.show(this.spec.times[0]);
    this.playing = true;
    this.button.textContent = 'Pause';
    let before = performance.now();
    const step = (now) => {
      if (!this.playing) return;
      const passed = (now - before) / 1000 * Number(this.speed.value);
      before = now;
      this.show(Math.min(this.time + Math.max(passed, 0), last));
      if (this.time >= last) this.pause(); else requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  pause() {
    this.playing = false;
    this.button.textContent = 'Play';
  }

  // Show the arm at a time [s]; between two frames it lies between them.
  show(time) {
    const { times } = this.spec;
    this.time = time;
    const step = (times[times.length - 1] - times[0]) / (times.length - 1);
    const place = Math.min(Math.max((time - times[0]) / step, 0), times.length - 1);
    const before = Math.min(Math.floor(place), times.length - 2);
    this.pose(before, before + 1, place - before);
    this.slider.value = time;
    this.readout.textContent = `${time.toFixed(3)} s`;
    this.tell(time);
  }
}
