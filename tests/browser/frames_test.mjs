// The check of the tree of frames finds each way in which a tree can be wrong.
import assert from "node:assert/strict";
import test from "node:test";
import { checkFrames } from "./frames.mjs";

const good = () => ({
  transforms: [
    { parent: "body", child: "head", at: 10n },
    { parent: "head", child: "lens/0", at: 10n },
    { parent: "enu", child: "body", at: 10n },
    { parent: "enu", child: "body", at: 20n },
  ],
  uses: [{ topic: "/cloud", frame: "enu", at: 5n }, { topic: "/camera/0", frame: "lens/0", at: 15n }],
});

test("a tree without an orphan is good", () => {
  const found = checkFrames(good());
  assert.deepEqual([found.frames, found.messages, found.topics], [4, 2, ["/camera/0", "/cloud"]]);
});
for (const [what, spoil, said] of [
  ["an orphan", ({ uses }) => uses.push({ topic: "/fix", frame: "antenna", at: 15n }), /antenna is an orphan/],
  ["a second parent", ({ transforms }) => transforms.push({ parent: "enu", child: "head", at: 12n }), /head has two parents/],
  ["a loop", ({ transforms }) => transforms.push({ parent: "b", child: "a", at: 1n }, { parent: "a", child: "b", at: 1n }), /its own ancestor/],
  ["a second root", ({ transforms }) => transforms.push({ parent: "map", child: "camera", at: 1n }), /map has no parent/],
  ["a transform that is late", ({ uses }) => uses.push({ topic: "/camera/0", frame: "lens/0", at: 9n }), /no transform yet/],
])
  test(`${what} is found`, () => {
    const tree = good();
    spoil(tree);
    assert.throws(() => checkFrames(tree), said);
  });
