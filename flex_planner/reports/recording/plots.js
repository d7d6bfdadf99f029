// Draws the report from the JSON in the page: tables, the arm, plots on canvas. No libraries.
// Plot: drag to zoom, double-click to zoom out, hover to read, click a name to hide a line.
'use strict';

const WIDE = 1.5; // of the height of lines, that bounds may add on either side
const DECADES = 4; // of a logarithmic axis: what is smaller is rounding, or nothing to see
const BAND = 'rgba(60, 60, 60, 0.22)';
const MARGIN = { left: 74, right: 14, top: 10, bottom: 42 };

function element(tag, parent, text = '', className = '') {
  const made = document.createElement(tag);
  made.textContent = text;
  if (className) made.className = className;
  if (parent) parent.appendChild(made);
  return made;
}

function format(value, digits = 5) {
  if (value === null || !Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e6)) {
    return value.toExponential(digits - 2).replace(/\.?0+e/, 'e');
  }
  return String(Number(value.toPrecision(digits)));
}

// Round numbers that divide a range, with about as many steps as asked for.
function ticks(low, high, count) {
  const raw = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 5, 10].find((factor) => power * factor >= raw * 0.999);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + step * 1e-9; k += 1) {
    found.push(Number((k * step).toPrecision(12)));
  }
  return found;
}

// Index of the first entry of ascending numbers that is not less.
function bisect(numbers, value) {
  let low = 0;
  let high = numbers.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (numbers[middle] < value) low = middle + 1; else high = middle;
  }
  return low;
}

class Plot {
  constructor(spec, axes, parent) {
    this.spec = spec;
    this.peers = [this];
    this.series = spec.series.map((entry) => ({ ...entry, xs: axes[entry.x], shown: true }));
    this.figure = element('figure', parent);
    this.figure.id = spec.key;
    element('figcaption', this.figure, spec.title);
    this.canvas = element('canvas', this.figure);
    this.canvas.setAttribute('role', 'img');
    this.canvas.setAttribute('aria-label', `${spec.title}: ${spec.y_label} over ${spec.x_label}`);
    this.bands = spec.bands && { ...spec.bands, shown: true };
    this.addLegend();
    this.addMouse();
    this.zoom = null;
    this.mark = null;
    new ResizeObserver(() => this.draw()).observe(this.figure);
  }

  addLegend() {
    const legend = element('div', this.figure, '', 'legend');
    for (const entry of this.series) {
      const button = this.addButton(legend, entry, entry.dashed ? 'swatch dashed' : 'swatch',
        entry.colour);
      entry.readout = element('output', button);
    }
    if (this.bands) this.addButton(legend, this.bands, 'swatch band', BAND);
    this.position = element('span', legend, '', 'position');
  }

  // Add what shows and hides a line, or the bands.
  addButton(legend, entry, kind, colour) {
    const button = element('button', legend);
    button.type = 'button';
    element('span', button, '', kind).style.borderColor = colour;
    element('span', button, entry.name);
    button.setAttribute('aria-pressed', 'true');
    button.addEventListener('click', () => {
      entry.shown = !entry.shown;
      button.setAttribute('aria-pressed', String(entry.shown));
      this.draw();
    });
    return button;
  }

  addMouse() {
    const place = (event) => event.clientX - this.canvas.getBoundingClientRect().left;
    let from = null;
    this.canvas.addEventListener('pointerdown', (event) => {
      from = place(event);
      this.canvas.setPointerCapture(event.pointerId);
    });
    this.canvas.addEventListener('pointermove', (event) => {
      this.selection = from === null ? null : [from, place(event)];
      this.hover(event);
    });
    this.canvas.addEventListener('pointerup', (event) => {
      const ends = from === null ? [] : [from, place(event)].sort((a, b) => a - b);
      from = null;
      this.selection = null;
      if (ends[1] - ends[0] > 5) this.share('zoom', ends.map((x) => this.toX(x)));
    });
    this.canvas.addEventListener('pointerleave', () => this.share('mark', null));
    this.canvas.addEventListener('dblclick', () => this.share('zoom', null));
  }

  share(name, value) {
    for (const peer of this.peers) {
      peer[name] = value;
      peer.draw();
    }
  }

  hover(event) {
    const box = this.canvas.getBoundingClientRect();
    if (!this.spec.equal) {
      this.share('mark', { x: this.toX(event.clientX - box.left) });
      return;
    }
    let best = Infinity;
    this.mark = null;
    for (const entry of this.series.filter((each) => each.shown)) {
      entry.xs.forEach((x, i) => {
        const away = Math.hypot(this.px(x) - event.clientX + box.left,
          this.py(entry.y[i]) - event.clientY + box.top);
        if (away < best) {
          best = away;
          this.mark = { x, entry, index: i };
        }
      });
    }
    this.draw();
  }

  // Where the shown points lie: [x low, x high, y low, y high].
  extent() {
    const shown = this.series.filter((entry) => entry.shown);
    const lines = shown.filter((entry) => !entry.bound);
    const found = this.reach(lines.length ? lines : shown, -Infinity, Infinity);
    if (lines.length && lines.length < shown.length && found[2] <= found[3]) {
      // bounds that are near are shown, too; far ones would press the lines flat
      const height = WIDE * Math.max(Math.max(found[3], 0) - Math.min(found[2], 0),
        this.spec.least);
      const near = this.reach(shown, found[2] - height, found[3] + height);
      [found[2], found[3]] = [near[2], near[3]];
    }
    return this.spread(found);
  }

  // The same of some lines, as far as their points lie between two heights.
  reach(lines, lowest, highest) {
    const found = [Infinity, -Infinity, Infinity, -Infinity];
    for (const { xs, y } of lines) {
      xs.forEach((x, i) => {
        const value = y[i];
        if (x === null || value === null || (this.spec.log && value <= 0)) return;
        if (this.zoom && (x < this.zoom[0] || x > this.zoom[1])) return;
        if (value < lowest || value > highest) return;
        found[0] = Math.min(found[0], x);
        found[1] = Math.max(found[1], x);
        const height = this.spec.log ? Math.log10(value) : value;
        found[2] = Math.min(found[2], height);
        found[3] = Math.max(found[3], height);
      });
    }
    return found;
  }

  // What is shown for points there: somewhat more, and no less than is worth a look.
  spread(found) {
    if (found[0] > found[1]) return [0, 1, 0, 1];
    if (this.spec.log) found[2] = Math.max(found[2], found[3] - DECADES);
    if (this.zoom) [found[0], found[1]] = this.zoom;
    const dotted = !this.zoom && this.series.some((entry) => entry.dots);
    for (const k of [0, 2]) {
      const share = k ? 0.05 : dotted ? 0.03 : 0;
      const spare = (found[k + 1] - found[k]) * share
        || (found[k + 1] > found[k] ? 0 : Math.abs(found[k]) * 0.05 || 1);
      found[k] -= spare;
      found[k + 1] += spare;
    }
    const lack = this.spec.log ? 0 : this.spec.least - (found[3] - found[2]);
    if (lack > 0) {
      found[2] -= lack / 2;
      found[3] += lack / 2;
    }
    return found;
  }

  fit() {
    const width = Math.max(this.figure.clientWidth, 240);
    const height = this.spec.equal ? Math.min(width, 460) : 260;
    const ratio = window.devicePixelRatio || 1;
    Object.assign(this.canvas.style, { width: `${width}px`, height: `${height}px` });
    this.canvas.width = width * ratio;
    this.canvas.height = height * ratio;
    this.width = width - MARGIN.left - MARGIN.right;
    this.height = height - MARGIN.top - MARGIN.bottom;
    this.range = this.extent();
    if (this.spec.equal) this.equalise();
    const pen = this.canvas.getContext('2d');
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    return pen;
  }

  // One metre is as long upwards as sideways.
  equalise() {
    const [left, right, low, high] = this.range;
    const scale = 1.08 * Math.max((right - left) / this.width, (high - low) / this.height);
    const [x, y] = [(left + right) / 2, (low + high) / 2];
    this.range = [x - scale * this.width / 2, x + scale * this.width / 2,
      y - scale * this.height / 2, y + scale * this.height / 2];
  }

  px(x) {
    const [left, right] = this.range;
    return MARGIN.left + (x - left) / (right - left) * this.width;
  }

  py(y) {
    const [, , low, high] = this.range;
    const height = this.spec.log ? Math.log10(y) : y;
    return MARGIN.top + (high - height) / (high - low) * this.height;
  }

  toX(pixel) {
    const [left, right] = this.range;
    const share = Math.min(Math.max((pixel - MARGIN.left) / this.width, 0), 1);
    return left + share * (right - left);
  }

  draw() {
    const pen = this.fit();
    pen.font = '12px system-ui, sans-serif';
    this.drawGrid(pen);
    pen.save();
    pen.beginPath();
    pen.rect(MARGIN.left, MARGIN.top, this.width, this.height);
    pen.clip();
    if (this.bands && this.bands.shown) this.drawBands(pen);
    for (const entry of this.series) if (entry.shown) this.drawSeries(pen, entry);
    if (this.bands && this.bands.shown) this.labelBands(pen);
    this.drawMark(pen);
    pen.restore();
  }

  drawGrid(pen) {
    const [left, right, low, high] = this.range;
    const bottom = MARGIN.top + this.height;
    pen.strokeStyle = '#e3e3e3';
    pen.fillStyle = '#444';
    pen.lineWidth = 1;
    pen.textAlign = 'center';
    for (const x of ticks(left, right, this.width / 90)) {
      this.line(pen, this.px(x), MARGIN.top, this.px(x), bottom);
      pen.fillText(format(x), this.px(x), bottom + 16);
    }
    pen.textAlign = 'right';
    const steps = this.spec.log ? ticks(low, high, 5).filter(Number.isInteger)
      : ticks(low, high, this.height / 32);
    for (const step of steps) {
      const y = this.py(this.spec.log ? 10 ** step : step);
      this.line(pen, MARGIN.left, y, MARGIN.left + this.width, y);
      pen.fillText(this.spec.log ? `1e${step}` : format(step), MARGIN.left - 6, y + 4);
    }
    pen.textAlign = 'center';
    pen.fillText(this.spec.x_label, MARGIN.left + this.width / 2, bottom + 34);
    pen.save();
    pen.translate(14, MARGIN.top + this.height / 2);
    pen.rotate(-Math.PI / 2);
    pen.fillText(this.spec.y_label, 0, 0);
    pen.restore();
    pen.strokeStyle = '#999';
    pen.strokeRect(MARGIN.left, MARGIN.top, this.width, this.height);
  }

  line(pen, x0, y0, x1, y1) {
    pen.beginPath();
    pen.moveTo(x0, y0);
    pen.lineTo(x1, y1);
    pen.stroke();
  }

  drawBands(pen) {
    pen.fillStyle = BAND;
    for (const [low, high] of this.bands.ranges) {
      const width = Math.max(this.px(high) - this.px(low), 2);
      pen.fillRect(this.px((low + high) / 2) - width / 2, MARGIN.top, width, this.height);
    }
  }

  // Labels of neighbours are on two lines: they are close where frequencies are.
  labelBands(pen) {
    Object.assign(pen, { textAlign: 'left', lineWidth: 3, strokeStyle: '#fff', fillStyle: '#333' });
    this.bands.ranges.forEach(([, high], i) => {
      const place = [this.bands.labels[i], this.px(high) + 3, MARGIN.top + (i % 2 ? 27 : 14)];
      pen.strokeText(...place);
      pen.fillText(...place);
    });
  }

  drawSeries(pen, { xs, y, colour, dashed, dots, filled }) {
    Object.assign(pen, { strokeStyle: colour, fillStyle: colour, lineWidth: dashed ? 1 : 1.7 });
    pen.setLineDash(dashed ? [5, 4] : []);
    pen.beginPath();
    let gap = true;
    xs.forEach((x, i) => {
      if (x === null || y[i] === null || (this.spec.log && y[i] <= 0)) {
        gap = true;
        return;
      }
      if (gap || dots) pen.moveTo(this.px(x), this.py(y[i]));
      else pen.lineTo(this.px(x), this.py(y[i]));
      if (dots) pen.arc(this.px(x), this.py(y[i]), 4, 0, 2 * Math.PI);
      gap = false;
    });
    if (filled) {
      pen.globalAlpha = 0.3;
      pen.fill();
      pen.globalAlpha = 1;
    }
    if (dots) pen.fill(); else pen.stroke();
    pen.setLineDash([]);
  }

  drawMark(pen) {
    for (const entry of this.series) entry.readout.textContent = '';
    this.position.textContent = '';
    if (this.selection) {
      pen.fillStyle = 'rgba(11, 98, 164, 0.12)';
      pen.fillRect(this.selection[0], 0, this.selection[1] - this.selection[0], 1e4);
    }
    if (!this.mark) return;
    pen.strokeStyle = '#777';
    if (!this.spec.equal) {
      this.line(pen, this.px(this.mark.x), MARGIN.top, this.px(this.mark.x), 1e4);
    }
    this.position.textContent = `${this.spec.x_label}: ${format(this.mark.x)}`;
    for (const entry of this.series.filter((each) => each.shown)) {
      const index = this.mark.entry ? this.mark.index : this.nearest(entry.xs, this.mark.x);
      if (this.mark.entry && this.mark.entry !== entry) continue;
      entry.readout.textContent = format(entry.y[index]);
      pen.fillStyle = entry.colour;
      pen.beginPath();
      pen.arc(this.px(entry.xs[index]), this.py(entry.y[index]), 3, 0, 2 * Math.PI);
      pen.fill();
    }
  }

  nearest(xs, x) {
    const after = Math.min(bisect(xs, x), xs.length - 1);
    return after && x - xs[after - 1] < xs[after] - x ? after - 1 : after;
  }
}

function addTable(table, parent) {
  const section = element('section', parent, '', table.columns.length > 7 ? 'wide' : '');
  element('h2', section, table.title);
  const made = element('table', section);
  if (table.columns.length) {
    const head = element('tr', element('thead', made));
    for (const name of table.columns) element('th', head, name);
  }
  const body = element('tbody', made);
  for (const row of table.rows) {
    const line = element('tr', body);
    row.forEach((cell, i) => element(i ? 'td' : 'th', line, cell, cell === 'FAILED' ? 'bad' : ''));
  }
}

function build() {
  const content = JSON.parse(document.getElementById('data').textContent);
  for (const table of content.tables) addTable(table, document.getElementById('tables'));
  const place = document.getElementById('plots');
  const plots = content.plots.map((spec) => new Plot(spec, content.axes, place));
  for (const plot of plots) {
    if (plot.spec.group) {
      plot.peers = plots.filter((other) => other.spec.group === plot.spec.group);
    }
    plot.draw();
  }
  if (content.arm) {
    const timed = plots.filter((plot) => plot.spec.group === 'time');
    const Shown = content.arm.radius ? SpatialArm : PlanarArm;
    const arm = new Shown(content.arm, document.getElementById('moving'), () => {});
    // once it is shown: marks before it moves would say nothing
    arm.tell = (time) => timed.length && timed[0].share('mark', { x: time });
  }
  document.body.dataset.plots = String(plots.length);
}

build();
