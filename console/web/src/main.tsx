import { render } from "preact";
import { App } from "./app";
import { beginSound } from "./state/alarms";
import { begin } from "./state/live";
import "uplot/dist/uPlot.min.css";
import "./style.css";

begin();
beginSound();
render(<App />, document.getElementById("page")!);
