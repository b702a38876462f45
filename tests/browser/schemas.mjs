// Messages of the schemas of hueline beside those of the same name in npm's @foxglove/schemas, which Foxglove publishes.
import protobuf from "protobufjs";
import internal from "@foxglove/schemas/internal.js";

const { foxgloveMessageSchemas, foxgloveEnumSchemas, generateProto } = internal;

/// Foxglove's own definitions, as its package writes them in protobuf.
const published = new protobuf.Root();
for (const schema of Object.values(foxgloveMessageSchemas)) {
  const inside = Object.values(foxgloveEnumSchemas).filter((one) => one.parentSchemaName === schema.name);
  protobuf.parse(generateProto(schema, inside), published, { keepCase: true });
}
// The well-known types are no part of the package.
for (const name of ["timestamp", "duration"]) {
  const { nested } = protobuf.common.get(`google/protobuf/${name}.proto`);
  published.addJSON(nested);
}
published.resolveAll();

const nameOf = (type) => type.fullName.slice(1);
const typeOf = (field) => (field.resolvedType ? nameOf(field.resolvedType) : field.type);

/// Compares `type`, and all types that it uses, with what Foxglove publishes under their names. Returns
/// {differences, compared: the names, left_out: what Foxglove has and hueline does not write}. Every field of hueline must be there with
/// the same name, number and type, single or repeated alike, and every enum must have the same words with the same numbers.
export function compareWithFoxglove(type) {
  const differences = [], compared = new Set(), left_out = [];
  const differ = (where, ours, theirs) => differences.push(`${where}: here ${ours}, at Foxglove ${theirs}`);
  const find = (one) => {
    try {
      return published.lookup(nameOf(one));
    } catch {
      return null;
    }
  };
  const compareEnums = (ours) => {
    const theirs = find(ours);
    if (!(theirs instanceof protobuf.Enum)) return differ(nameOf(ours), "an enum", "none");
    const sorted = (one) => JSON.stringify(Object.entries(one.values).sort());
    if (sorted(ours) !== sorted(theirs)) differ(nameOf(ours), sorted(ours), sorted(theirs));
  };
  const compare = (ours) => {
    const name = nameOf(ours);
    if (compared.has(name)) return;
    compared.add(name);
    if (ours instanceof protobuf.Enum) return compareEnums(ours);
    const theirs = find(ours);
    if (!(theirs instanceof protobuf.Type)) return differ(name, "a message", "none");
    for (const field of ours.fieldsArray) {
      const where = `${name}.${field.name}`;
      const other = theirs.fields[field.name];
      if (!other) {
        differ(where, "a field", "none");
        continue;
      }
      if (field.id !== other.id) differ(where, `number ${field.id}`, `number ${other.id}`);
      if (typeOf(field) !== typeOf(other)) differ(where, typeOf(field), typeOf(other));
      if (field.repeated !== other.repeated) differ(where, `repeated: ${field.repeated}`, `repeated: ${other.repeated}`);
      if (field.resolvedType) compare(field.resolvedType);
    }
    for (const field of theirs.fieldsArray) if (!ours.fields[field.name]) left_out.push(`${name}.${field.name}`);
  };
  compare(type);
  return { differences, compared: [...compared], left_out };
}
