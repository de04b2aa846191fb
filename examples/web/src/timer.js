// How long frames take: by the clock of the graphics processor where the browser lets one read it, else by how long one pixel of the frame
// takes to come back.

const KEPT = 31;

export class Timer {
  #gl;
  #extension;
  #pending = [];
  #times = [];

  constructor(gl) {
    this.#gl = gl;
    this.#extension = gl.getExtension('EXT_disjoint_timer_query_webgl2');
  }

  /** Whose clock it is. */
  get clock() {
    return this.#extension ? 'GPU' : 'until a pixel is back';
  }

  get isWaiting() {
    return this.#pending.length > 0;
  }

  get count() {
    return this.#times.length;
  }

  /** Milliseconds, NaN if there is none yet. */
  get median() {
    const times = [...this.#times].sort((a, b) => a - b);
    return times.length > 0 ? times[times.length >> 1] : NaN;
  }

  /** Forgets what there was: something else is drawn now. */
  reset() {
    this.#times = [];
    this.#pending.forEach(({ query }) => this.#gl.deleteQuery(query));
    this.#pending = [];
  }

  time(draw) {
    const gl = this.#gl;
    if (this.#extension) {
      const query = gl.createQuery();
      gl.beginQuery(this.#extension.TIME_ELAPSED_EXT, query);
      draw();
      gl.endQuery(this.#extension.TIME_ELAPSED_EXT);
      this.#pending.push({ query });
      return;
    }
    const start = performance.now();
    draw();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    this.#keep(performance.now() - start);
  }

  /** Takes the times that have come in. */
  poll() {
    const gl = this.#gl;
    while (this.isWaiting && gl.getQueryParameter(this.#pending[0].query, gl.QUERY_RESULT_AVAILABLE)) {
      const { query } = this.#pending.shift();
      const isDisjoint = gl.getParameter(this.#extension.GPU_DISJOINT_EXT);
      if (!isDisjoint) {
        this.#keep(gl.getQueryParameter(query, gl.QUERY_RESULT) / 1e6);
      }
      gl.deleteQuery(query);
    }
  }

  #keep(time) {
    this.#times.push(time);
    if (this.#times.length > KEPT) {
      this.#times.shift();
    }
  }
}
