// What the words of the page mean: shown where the pointer rests on one.

const TERMS = {
  "sight": "Level area around the vehicle that its body can reach within observed free space",
  "seen to be free": "Level area around the vehicle that its body can reach within observed free space",
  "seen to be free ahead": "Observed free space on the course, for the vehicle's body",
  "fastest that stops within": "Greatest speed from which the vehicle brakes to rest within that distance",
  "now, next, greatest": "Speed now, after the next movement, and the greatest that the vehicle may fly",
  "reach set": "All trajectories that the decision rated",
  "plan": "The chosen trajectory",
  "escape": "What is flown if no later decision comes: movements, then a loop or a stop",
  "escape, to rest": "What is flown if no later decision comes: movements that brake to rest",
  "held escape": "What is flown if no later decision comes: movements, then a loop or a stop",
  "Held escape (dashed)": "What is flown if no later decision comes: movements, then a loop or a stop",
  "margin": "Distance that the vehicle keeps from everything known",
  "tube of the plan": "How far the vehicle may be from its plan",
  "points": "LiDAR returns: what the decision used, and, paler, what was known before",
  "route": "The route to the goal",
  "not on the map": "Stands in the simulated world, and on no map",
  "also on the map": "Stands in the simulated world, and on the map",
  "only on the map": "On the map, but not in the simulated world",
  "kept out of": "A zone that no trajectory may enter",
  "nearest obstacle": "Distance to the nearest obstacle's surface, and the margin to keep",
};
