// What the charts and maps of one run share: which estimators are shown, which one is looked at in detail, and the moment
// under the cursor.

export class RunState {
  constructor(run) {
    this.run = run;
    this.hidden = new Set();
    this.detail = 0;        // index of the estimator whose directions and degenerate stretches are shown
    this.moment = null;     // index on the time axis, or null
    this.span = null;       // [first, last] second that the charts show, or null for all
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
