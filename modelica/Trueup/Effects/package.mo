within Trueup;
package Effects "What may act in a real joint beyond its equations, one block each"
end Effects;
