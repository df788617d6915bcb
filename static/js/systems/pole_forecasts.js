// Sigmas at the point of a survey, m: `scripts/pole-forecasts` makes this file.

/** Of a route by its letter: `live_m` in plan at the end of the gap, before the sky comes back. */
export const FORECASTS = [
  { route: "I", metres: 20, plan_m: 0.021, up_m: 0.009, live_m: 0.101 },
  { route: "I", metres: 40, plan_m: 0.029, up_m: 0.011, live_m: 0.275 },
  { route: "I", metres: 60, plan_m: 0.04, up_m: 0.013, live_m: 0.466 },
  { route: "I", metres: 80, plan_m: 0.055, up_m: 0.015, live_m: 0.602 },
  { route: "I", metres: 100, plan_m: 0.071, up_m: 0.016, live_m: 0.617 },
  { route: "L", metres: 20, plan_m: 0.024, up_m: 0.008, live_m: 0.142 },
  { route: "L", metres: 40, plan_m: 0.037, up_m: 0.011, live_m: 0.349 },
  { route: "L", metres: 60, plan_m: 0.046, up_m: 0.012, live_m: 0.483 },
  { route: "L", metres: 80, plan_m: 0.058, up_m: 0.014, live_m: 0.729 },
  { route: "L", metres: 100, plan_m: 0.069, up_m: 0.016, live_m: 0.724 },
  { route: "U", metres: 20, plan_m: 0.038, up_m: 0.008, live_m: 0.076 },
  { route: "U", metres: 40, plan_m: 0.055, up_m: 0.01, live_m: 0.205 },
  { route: "U", metres: 60, plan_m: 0.068, up_m: 0.012, live_m: 0.328 },
  { route: "U", metres: 80, plan_m: 0.087, up_m: 0.014, live_m: 0.569 },
  { route: "U", metres: 100, plan_m: 0.105, up_m: 0.016, live_m: 0.621 },
  { route: "B", metres: 20, plan_m: 0.045, up_m: 0.011, live_m: 0.124 },
  { route: "B", metres: 40, plan_m: 0.104, up_m: 0.014, live_m: 0.396 },
  { route: "B", metres: 60, plan_m: 0.191, up_m: 0.017, live_m: 0.59 },
  { route: "B", metres: 80, plan_m: 0.308, up_m: 0.02, live_m: 0.65 },
  { route: "B", metres: 100, plan_m: 0.404, up_m: 0.022, live_m: 0.777 },
];
