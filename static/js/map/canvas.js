// One canvas over the map, drawn in metres east and north. It rides along while the map is dragged and
// scales along while it zooms, and is drawn anew when the map rests or its content changes, at most once a frame.

import { inkOf } from "./ink.js";

/** How much larger than the view the canvas is, on each side, so that a drag shows no bare edge at once. */
const PADDING = 0.15;

/**
 * @typedef {{
 *   x: (e_m: number) => number, y: (n_m: number) => number, scale: number,
 *   ink: import("./ink.js").Ink, width: number, height: number,
 *   sees: (e_m: number, n_m: number, margin_px?: number) => boolean,
 * }} Paper `scale` is pixels per metre
 * @typedef {(context: CanvasRenderingContext2D, paper: Paper) => void} Draw
 */

export class EastNorthCanvas {
  /**
   * @param {L.Map} map
   * @param {string} pane
   * @param {Draw} draw
   */
  constructor(map, pane, draw) {
    this.map = map;
    this.draw = draw;
    this.canvas = document.createElement("canvas");
    this.canvas.className = "leaflet-zoom-animated map-canvas";
    this.canvas.setAttribute("aria-hidden", "true");
    const context = this.canvas.getContext("2d");
    if (!context) throw new Error("this browser draws no canvas");
    this.context = context;
    map.getPane(pane)?.append(this.canvas);
    this.zoom = map.getZoom();
    this.topLeft = map.getCenter();
    this.frame = 0;
    this.zooming = false;
    /** Until it is shown: a canvas takes nine megabytes, and as long to be handed over empty as full. */
    this.hidden = this.canvas.hidden = true;
    /** What of the map the canvas shows, in a word; "" when its content has changed since. */
    this.drawn = "";
    map.on("moveend resize", () => this.settle());
    map.on("zoomanim", (event) => {
      this.zooming = true;
      this.scaleTo(event.center, event.zoom);
    });
    map.on("zoom", () => this.scaleTo(map.getCenter(), map.getZoom()));
    map.on("zoomend", () => {
      this.zooming = false;
      this.settle();
    });
  }

  /** Where the map has come to rest the canvas shows all of it. One move of the map tells several ends: it is drawn once. */
  settle() {
    if (this.drawn !== this.view()) this.repaint();
  }

  view() {
    const { map } = this;
    const [size, corner, origin] = [map.getSize(), map.containerPointToLayerPoint([0, 0]), map.getPixelOrigin()];
    return [map.getZoom(), corner.x, corner.y, origin.x, origin.y, size.x, size.y, window.devicePixelRatio].join(" ");
  }

  /** Draws anew with the next frame. */
  invalidate() {
    this.drawn = "";
    if (this.frame === 0 && !this.hidden) this.frame = requestAnimationFrame(() => this.repaint());
  }

  /** @param {boolean} shown */
  setShown(shown) {
    if (this.hidden === !shown) return;
    this.hidden = !shown;
    this.canvas.hidden = !shown;
    if (shown) this.invalidate();
  }

  repaint() {
    cancelAnimationFrame(this.frame);
    this.frame = 0;
    // In the middle of a zoom the canvas is scaled by the browser; its end draws it.
    if (this.zooming || this.hidden) return;
    this.drawn = this.view();
    const { map, canvas, context } = this;
    const size = map.getSize();
    const pad = size.multiplyBy(PADDING).round();
    const corner = map.containerPointToLayerPoint(pad.multiplyBy(-1));
    this.zoom = map.getZoom();
    this.topLeft = map.layerPointToLatLng(corner);
    L.DomUtil.setTransform(canvas, corner, 1);
    const width = size.x + 2 * pad.x;
    const height = size.y + 2 * pad.y;
    const ratio = window.devicePixelRatio || 1;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
      canvas.style.width = `${width}px`;
      canvas.style.height = `${height}px`;
    }
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    const scale = 2 ** this.zoom;
    const { lng: west, lat: north } = this.topLeft;
    const x = (/** @type {number} */ e_m) => (e_m - west) * scale;
    const y = (/** @type {number} */ n_m) => (north - n_m) * scale;
    this.draw(context, {
      x,
      y,
      scale,
      width,
      height,
      ink: inkOf(),
      sees: (e_m, n_m, margin_px = 20) =>
        x(e_m) > -margin_px && x(e_m) < width + margin_px && y(n_m) > -margin_px && y(n_m) < height + margin_px,
    });
  }

  /**
   * @param {L.LatLng} center
   * @param {number} zoom
   */
  scaleTo(center, zoom) {
    const { map } = this;
    const pane = map.getPane("mapPane");
    if (!pane) return;
    const origin = map
      .project(center, zoom)
      .subtract(map.getSize().divideBy(2))
      .add(L.DomUtil.getPosition(pane))
      .round();
    L.DomUtil.setTransform(
      this.canvas,
      map.project(this.topLeft, zoom).subtract(origin),
      map.getZoomScale(zoom, this.zoom),
    );
  }
}
