// State common to charts and maps of one run: the shown estimators, the one in detail, and the time of the cursor.

export class RunState {
  constructor(run) {
    this.run = run;
    this.hidden = new Set();
    this.detail = 0; // index of the estimator with shown directions and degenerate intervals
    this.moment = null; // index on the time axis, or null
    this.span = null; // [first, last] shown second, or null for all
    this.listeners = { shown: [], moment: [], detail: [], span: [] };
  }

  on(event, act) {
    this.listeners[event].push(act);
  }

  #tell(event, source) {
    this.listeners[event].forEach((act) => act(source));
  }

  toggle(name) {
    if (!this.hidden.delete(name)) this.hidden.add(name);
    this.#tell('shown');
  }

  isShown(name) {
    return !this.hidden.has(name);
  }

  look(index) {
    this.detail = index;
    this.#tell('detail');
  }

  point(moment, source) {
    if (moment === this.moment) return;
    this.moment = moment;
    this.#tell('moment', source);
  }

  zoom(span, source) {
    this.span = span;
    this.#tell('span', source);
  }
}
