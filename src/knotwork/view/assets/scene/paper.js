// The scene on paper: its canvas, and over it the words as they stand on the screen.
// `labels` are boxes with the lines that lead to them, and `fine` the picture's pixels for each of the window's. Gives the address of a picture.
function pictureWithWords(scene, pane, labels, legend, fine) {
  const canvas = document.createElement("canvas");
  canvas.width = Math.round(fine * pane.width);
  canvas.height = Math.round(fine * pane.height);
  const pen = canvas.getContext("2d");
  pen.drawImage(scene, 0, 0, canvas.width, canvas.height);
  pen.scale(fine, fine);
  pen.textBaseline = "middle";
  const inPane = (element) => {
    const box = element.getBoundingClientRect();
    return [box.left - pane.left, box.top - pane.top, box.width, box.height];
  };
  const word = (element) => {
    const look = getComputedStyle(element);
    const [x, y, , height] = inPane(element);
    pen.font = `${look.fontStyle} ${look.fontWeight} ${look.fontSize} ${look.fontFamily}`;
    pen.fillStyle = look.color;
    pen.fillText(element.textContent, x + parseFloat(look.paddingLeft), y + height / 2);
  };
  const plate = (element) => {
    const look = getComputedStyle(element);
    pen.beginPath();
    if (pen.roundRect) pen.roundRect(...inPane(element), parseFloat(look.borderRadius));
    else pen.rect(...inPane(element)); // in browsers from before 2023
    pen.fillStyle = look.backgroundColor;
    pen.fill();
    if (!parseFloat(look.borderWidth)) return;
    pen.strokeStyle = look.borderColor;
    pen.stroke();
  };
  for (const { line } of labels) {
    const [x1, y1, x2, y2] = ["x1", "y1", "x2", "y2"].map((name) => Number(line.getAttribute(name)));
    pen.strokeStyle = getComputedStyle(line).stroke;
    pen.beginPath();
    pen.moveTo(x1, y1);
    pen.lineTo(x2, y2);
    pen.stroke();
  }
  for (const { box } of labels) {
    plate(box);
    word(box);
  }
  if (legend && legend.offsetHeight) {
    plate(legend);
    for (const element of legend.querySelectorAll(".scale")) {
      const [x, y, width, height] = inPane(element);
      const scale = pen.createLinearGradient(x, 0, x + width, 0);
      element.dataset.colours.split(",").forEach((colour, i, all) => scale.addColorStop(i / (all.length - 1), colour));
      pen.fillStyle = scale;
      pen.fillRect(x, y, width, height);
    }
    for (const tick of legend.querySelectorAll(".tick")) if (tick.offsetHeight) plate(tick);
    for (const element of legend.querySelectorAll(".word")) if (element.offsetHeight) word(element);
    for (const red of legend.querySelectorAll(".red")) if (red.offsetHeight) plate(red);
  }
  return canvas.toDataURL("image/png");
}

// A still picture for paper: what is seen, with its labels and legend; of one size everywhere
function still(viewer, camera, labels) {
  const fine = 2;
  const { renderer } = viewer;
  const before = renderer.getPixelRatio();
  const draw = (pixels) => {
    renderer.setPixelRatio(pixels);
    camera.resized();
    viewer.render();
    labels.place();
  };
  document.body.classList.add("still");
  const legend = byId("legend");
  const open = legend?.open;
  if (legend) legend.open = true;
  draw(fine);
  const address = pictureWithWords(renderer.domElement, paneBox(), labels.seen(), legend, fine);
  if (legend) legend.open = open;
  document.body.classList.remove("still");
  draw(before);
  return address;
}
