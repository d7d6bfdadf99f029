// The arm as it moves, in SVG: a slider, a button that plays, a choice of speeds. No libraries.
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

class Arm {
  // tell(time) is called with the time that is shown
  constructor(spec, parent, tell) {
    Object.assign(this, { spec, tell, playing: false });
    this.figure = element('figure', parent);
    this.figure.id = 'arm';
    element('figcaption', this.figure, 'The arm in motion, links as they bend');
    const [left, low, width, height] = spec.box;
    this.unit = Math.max(width, height) / 100;
    this.svg = drawing('svg', this.figure, {
      viewBox: `${left} ${-low - height} ${width} ${height}`, role: 'img',
      'aria-label': 'The arm in motion' });
    // y upwards
    this.plane = drawing('g', this.svg, { transform: 'scale(1, -1)', fill: 'none',
      'stroke-linejoin': 'round', 'stroke-linecap': 'round' });
    this.addStill();
    this.addMoving();
    this.addControls();
    this.show(spec.times[0]);
  }

  line(points, colour, width) {
    return drawing('polyline', this.plane, {
      points: points.join(' '), stroke: colour, 'stroke-width': width * this.unit });
  }

  dot(colour, size) {
    return drawing('circle', this.plane, { r: size * this.unit, fill: colour });
  }

  // What does not move: the arm at both ends, the path of the tip, the base, what is kept free.
  addStill() {
    const { links, tip, colours, keep_outs: regions } = this.spec;
    for (const region of regions) {
      drawing('polygon', this.plane, { points: region.join(' '), fill: colours.refused,
        'fill-opacity': 0.3 });
    }
    for (const frame of [links[0], links[links.length - 1]]) {
      for (const link of frame) this.line(link, colours.aside, 0.6);
    }
    this.path = this.line(tip, colours.tip, 0.25);
    this.path.setAttribute('stroke-dasharray', `${this.unit} ${this.unit}`);
    const size = 1.6 * this.unit;
    drawing('rect', this.plane, { x: -size, y: -size, width: 2 * size, height: 2 * size,
      fill: colours.rigid });
  }

  addMoving() {
    const { links, flexible, colours, loaded } = this.spec;
    this.links = links[0].map((link, i) => this.line(link,
      flexible[i] ? colours.flexible : colours.rigid, 1.1));
    this.joints = links[0].map(() => drawing('circle', this.plane, {
      r: this.unit, fill: '#fff', stroke: colours.rigid, 'stroke-width': 0.4 * this.unit }));
    this.payload = this.dot(colours.tip, loaded ? 1.6 : 0.8);
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
    const { times, links, payload } = this.spec;
    this.time = time;
    const step = (times[times.length - 1] - times[0]) / (times.length - 1);
    const place = Math.min(Math.max((time - times[0]) / step, 0), times.length - 1);
    const before = Math.min(Math.floor(place), times.length - 2);
    links[before].forEach((link, i) => {
      const points = between(link, links[before + 1][i], place - before);
      this.links[i].setAttribute('points', points.join(' '));
      this.put(this.joints[i], points);
    });
    this.put(this.payload, between(payload[before], payload[before + 1], place - before));
    this.slider.value = time;
    this.readout.textContent = `${time.toFixed(3)} s`;
    this.tell(time);
  }

  put(mark, [x, y]) {
    mark.setAttribute('cx', x);
    mark.setAttribute('cy', y);
  }
}
