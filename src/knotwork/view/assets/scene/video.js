// A video of the motion from start to end, as shown, for slides and messages.

const VIDEO_END = 2000; // time for which the end is shown [ms]

function offerVideo(viewer, player) {
  const canvas = viewer.renderer.domElement;
  const kind = ["video/webm;codecs=vp8", "video/webm", "video/mp4"].find((type) => window.MediaRecorder?.isTypeSupported(type));
  if (!kind || !canvas.captureStream) return;
  const button = Object.assign(document.createElement("button"), { id: "video", type: "button", textContent: "video" });
  button.title = "record the motion from start to end, at the speed chosen, and download it";
  byId("shown").append(button);
  button.addEventListener("click", () => {
    const [loops, chunks] = [player.loops, []];
    const recorder = new MediaRecorder(canvas.captureStream(30), { mimeType: kind, videoBitsPerSecond: 8e6 });
    recorder.ondataavailable = ({ data }) => chunks.push(data);
    recorder.onstop = () => {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(new Blob(chunks, { type: kind }));
      link.download = `${document.title.split(" · ")[0]}.${kind.includes("webm") ? "webm" : "mp4"}`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 60000);
      Object.assign(button, { disabled: false, textContent: "video" });
      player.loop(loops);
    };
    Object.assign(button, { disabled: true, textContent: "recording …" });
    player.loop(false);
    player.seek(0);
    recorder.start();
    player.toggle();
    // A slow encoder loses frames that it has not written when it stops, so the end is held meanwhile.
    let end;
    const wait = (now) => {
      end = player.running ? undefined : (end ?? now + VIDEO_END);
      if (end !== undefined) viewer.render();
      if (end < now) recorder.stop();
      else requestAnimationFrame(wait);
    };
    requestAnimationFrame(wait);
  });
}
