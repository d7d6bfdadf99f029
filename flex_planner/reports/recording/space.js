// A spatial arm as it moves, in SVG, seen from a side that the mouse or the arrow keys choose: a
// parallel projection, a floor with the arm's shadow, links that are nearer over those that are
// farther. No libraries.
'use strict';

const TURN = 0.01; // rad per pixel
const STEP = Math.PI / 36; // rad per key
const VIEWS = { 'from a corner': [-0.9, 0.45], 'from the front': [-Math.PI / 2, 0],
  'from the right': [0, 0], 'from above': [-Math.PI / 2, Math.PI / 2] };
const FLOOR = '#e3e3e3';
const SHADOW = '#d0d0d0';
const AXES = ['#c0392b', '#2a8a3e', '#2f6fb3']; // x, y, z
const NAMES = 'xyz';

class SpatialArm extends Player {
  constructor(spec, parent, tell) {
    super(spec, parent, tell, 'The arm in motion, links as they bend: drag to turn it');
  }

  addShapes() {
    const { radius } = this.spec;
    [this.azimuth, this.elevation] = VIEWS['from a corner'];
    this.unit = radius / 50;
    this.svg = drawing('svg', this.figure, {
      viewBox: `${-radius} ${-radius} ${2 * radius} ${2 * radius}`, role: 'img', tabindex: 0,
      'aria-label': 'The arm in motion; arrow keys turn it', 'class': 'space' });
    this.space = drawing('g', this.svg, { fill: 'none', 'stroke-linejoin': 'round',
      'stroke-linecap': 'round' });
    this.addStill();
    this.addMoving();
    this.addTurning();
    this.addViews();
  }

  // A line through points of space; all that is drawn is drawn again when the view turns.
  line(points, colour, width) {
    const made = drawing('polyline', this.space, { stroke: colour,
      'stroke-width': width * this.unit });
    return { made, points };
  }

  dot(colour, size) {
    return drawing('circle', this.space, { r: size * this.unit, fill: colour });
  }

  addStill() {
    const { links, tip, colours, floor, base, keep_outs } = this.spec;
    this.still = floor.map((line) => this.line(line, FLOOR, 0.15));
    this.shadow = this.line([], SHADOW, 0.9);
    const length = 8 * this.unit;
    this.still.push(...AXES.map((colour, i) => this.line(
      [...base, ...base.map((value, k) => value + (k === i ? length : 0))], colour, 0.4)));
    this.names = AXES.map((colour, i) => {
      const made = drawing('text', this.space, { fill: colour, 'font-size': 3 * this.unit,
        'text-anchor': 'middle', 'dominant-baseline': 'central' });
      made.textContent = NAMES[i];
      return { made, place: base.map((value, k) => value + (k === i ? 1.2 * length : 0)) };
    });
    for (const frame of [links[0], links[links.length - 1]]) {
      this.still.push(...frame.map((link) => this.line(link, colours.aside, 0.6)));
    }
    this.still.push(...keep_outs.map((line) => this.line(line, colours.refused, 0.25)));
    const path = this.line(tip, colours.tip, 0.3);
    path.made.setAttribute('stroke-dasharray', `${this.unit} ${this.unit}`);
    this.still.push(path);
  }

  addMoving() {
    const { links, flexible, slides, colours, loaded } = this.spec;
    this.links = links[0].map((link, i) => {
      const made = drawing('g', this.space);
      const colour = flexible[i] ? colours.flexible : colours.rigid;
      return { made, line: drawing('polyline', made, { stroke: colour,
        'stroke-width': 1.2 * this.unit }),
      joint: drawing('circle', made, { r: (slides[i] ? 0.7 : 1) * this.unit, fill: '#fff',
        stroke: colours.rigid, 'stroke-width': 0.4 * this.unit }) };
    });
    this.hand = AXES.map((colour) => this.line([], colour, 0.35));
    this.payload = this.dot(colours.tip, loaded ? 1.5 : 0.8);
  }

  addTurning() {
    let last = null;
    this.svg.addEventListener('pointerdown', (event) => {
      last = [event.clientX, event.clientY];
      this.svg.setPointerCapture(event.pointerId);
    });
    this.svg.addEventListener('pointermove', (event) => {
      if (!last) return;
      this.turn(TURN * (last[0] - event.clientX), TURN * (event.clientY - last[1]));
      last = [event.clientX, event.clientY];
    });
    for (const end of ['pointerup', 'pointercancel']) {
      this.svg.addEventListener(end, () => { last = null; });
    }
    const keys = { ArrowLeft: [STEP, 0], ArrowRight: [-STEP, 0], ArrowUp: [0, STEP],
      ArrowDown: [0, -STEP] };
    this.svg.addEventListener('keydown', (event) => {
      if (!keys[event.key]) return;
      event.preventDefault();
      this.turn(...keys[event.key]);
    });
  }

  addViews() {
    const views = element('div', this.figure, '', 'controls views');
    for (const [name, angles] of Object.entries(VIEWS)) {
      const button = element('button', views, name);
      button.type = 'button';
      button.addEventListener('click', () => {
        [this.azimuth, this.elevation] = angles;
        this.turn(0, 0);
      });
    }
  }

  turn(azimuth, elevation) {
    this.azimuth += azimuth;
    this.elevation = Math.min(Math.max(this.elevation + elevation, -Math.PI / 2), Math.PI / 2);
    this.show(this.time);
  }

  // Where a point of space is on the screen, and how near it is to the eye.
  seen(x, y, z) {
    const [cx, cy, cz] = this.spec.centre;
    const [c, s] = [Math.cos(this.azimuth), Math.sin(this.azimuth)];
    const [e, f] = [Math.cos(this.elevation), Math.sin(this.elevation)];
    const out = c * (x - cx) + s * (y - cy);
    return [c * (y - cy) - s * (x - cx), f * out - e * (z - cz), e * out + f * (z - cz)];
  }

  // Points x, y, z, x, y, z ... as those of the screen, and the mean of how near they are.
  project(points) {
    const flat = [];
    let near = 0;
    for (let i = 0; i < points.length; i += 3) {
      const [x, y, depth] = this.seen(points[i], points[i + 1], points[i + 2]);
      flat.push(x.toFixed(2), y.toFixed(2));
      near += depth;
    }
    return { text: flat.join(' '), near: 3 * near / points.length };
  }

  put(mark, place, names = ['cx', 'cy']) {
    this.seen(...place).slice(0, 2).forEach((value, i) => mark.setAttribute(names[i], value));
  }

  pose(low, high, share) {
    const { links, payload, hand, ground } = this.spec;
    for (const line of this.still) line.made.setAttribute('points', this.project(line.points).text);
    for (const { made, place } of this.names) this.put(made, place, ['x', 'y']);
    const posed = links[low].map((link, i) => between(link, links[high][i], share));
    posed.forEach((points, i) => {
      const { text, near } = this.project(points);
      const link = this.links[i];
      link.near = near;
      link.line.setAttribute('points', text);
      this.put(link.joint, points);
    });
    const fallen = posed.flat().map((value, i) => (i % 3 === 2 ? ground : value));
    this.shadow.made.setAttribute('points', this.project(fallen).text);
    const front = this.hand[0].made;
    for (const link of [...this.links].sort((a, b) => a.near - b.near)) {
      this.space.insertBefore(link.made, front);
    }
    const tip = posed[posed.length - 1].slice(-3);
    const axes = between(hand[low], hand[high], share);
    this.hand.forEach((line, i) => line.made.setAttribute('points', this.project([...tip,
      ...tip.map((value, k) => value + 5 * this.unit * axes[3 * i + k])]).text));
    this.put(this.payload, between(payload[low], payload[high], share));
  }
}
