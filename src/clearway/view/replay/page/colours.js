// Colour scales of the documentation's pictures, and the colours of things. Parts of 1, not of 255.

const hex = (text) => [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16) / 255);
const css = (rgb) => `rgb(${rgb.map((part) => Math.round(255 * part)).join(",")})`;

const SCALES = {
  passable: ["#a50026", "#f46d43", "#f5c25b", "#a6cde3", "#4a98c9", "#2155a0"].map(hex),
  obstacle: ["#c3ccd1", "#f7c79c", "#ef8a62", "#b2182b", "#5d0018"].map(hex),
  visible: ["#2d3463", "#7f86b5", "#ded5a4"].map(hex),
  terrain: ["#7f9a78", "#a9b48a", "#cdbf97", "#b79c78", "#e6e1da"].map(hex),
  speed: ["#440154", "#3b528b", "#21918c", "#5ec962", "#fde725"].map(hex),
  height: ["#4f6d7a", "#7a9e8e", "#c9bb8e", "#b98b6a"].map(hex),
};

function onScale(stops, value) {
  const at = Math.min(Math.max(value, 0), 1) * (stops.length - 1);
  const low = Math.min(Math.floor(at), stops.length - 2);
  return between(stops[low], stops[low + 1], at - low);
}

const COLOURS = {
  executed: hex("#1f5fbf"), ahead: hex("#a9bcd6"), planned: hex("#d62728"),
  waypoint: hex("#2e9e4f"), intruder: hex("#c2186b"), known: hex("#7b3fa0"),
  vehicle: hex("#12336b"), margin: hex("#5b8db8"), grid: hex("#c3ccd5"), stem: hex("#94a1ae"),
  wayout: hex("#088c82"), sight: hex("#5fbf7f"), nose: hex("#e8762c"), beside: hex("#7a4b12"), besidePlan: hex("#c79a52"),
  picked: hex("#111111"), seen: hex("#a3281c"), before: hex("#c9a69a"),
  ground: hex("#d9dbd6"), world: hex("#c9935f"), both: hex("#98a0a8"), map: hex("#7d8fd0"), rule: hex("#d9594c"),
};

// What cells can be coloured by: name in the file, what it is, its scale, and how telling a value
// is (0 hides the cell where only the telling ones are shown).
const rated = (name) => ({
  key: `rating_${name}`, title: `rating "${name}"`, scale: "passable",
  ends: ["0 blocked", "1 safe"], telling: (value) => 1 - value,
});
const RATING = "rating_", RATINGS_AT = 3;
const COLOURINGS = [
  { key: "obstacle", title: "obstacle P_O", scale: "obstacle", ends: ["0 free", "1 obstacle"],
    telling: (value) => value },
  { key: "visibility", title: "visibility P_V", scale: "visible", ends: ["0 hidden", "1 seen"],
    telling: (value) => 1 - value },
  { key: "reachability", title: "reachability", scale: "passable",
    ends: ["0 out of reach", "1 reached safely"], telling: (value, passed) => passed * (1 - value) },
  { key: "detected", title: "detected P_OD", scale: "obstacle", ends: ["0", "1 returns"],
    telling: (value) => value },
  { key: "map", title: "map P_OM", scale: "obstacle", ends: ["0", "1 filled by the map"],
    telling: (value) => value },
  { key: "intruder", title: "intruder P_OI", scale: "obstacle", ends: ["0", "1 met"],
    telling: (value) => value },
];

// Ratings are those that the run was recorded with.
function offerRatings(quantities) {
  const names = quantities.filter((key) => key.startsWith(RATING)).map((key) => key.slice(RATING.length));
  COLOURINGS.splice(RATINGS_AT, 0, ...names.map(rated));
}
